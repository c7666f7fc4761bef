// shade/character.glsl — what kind of land the whole map is, measured once from its heights.
// Provides greenness(), snowiness(), saturation().   Python twin: light.lobes.Character

uniform float u_hypsometric;  // mean height in the map's range, 0 to 1
uniform float u_rms_slope;

// Peaks over wide valleys have a low hypsometric integral, plateaus cut by canyons, and craters, a high one (Strahler
// 1952, "Hypsometric (area-altitude) analysis of erosional topography").
float greenness() { return 1.0 - smoothstep(0.27, 0.42, u_hypsometric); }

float snowiness() { return greenness() * smoothstep(0.15, 0.30, u_rms_slope); }

float saturation() { return mix(0.55, 1.0, smoothstep(0.15, 0.5, u_rms_slope)); }
