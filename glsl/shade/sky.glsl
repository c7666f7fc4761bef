// shade/sky.glsl — a clear sky in closed form, and the light that comes from it.
// Provides sky_light(), sun_light(), skylight_on(), hazed().

#define HAZE_THICKNESS 0.1  // of u_haze_m

uniform vec3 u_sun;         // towards it, unit
uniform float u_haze_m;     // distance at which haze lets 1/e through

// Low suns are warm: their light crosses more air, which takes the blue out.
vec3 sun_light() {
    float air = 1.0 / (max(u_sun.z, 0.0) + 0.10);
    float risen = smoothstep(-0.06, 0.06, u_sun.z);
    return 9.5 * risen * exp(-vec3(0.055, 0.110, 0.205) * air);
}

float day() { return smoothstep(-0.15, 0.35, u_sun.z); }

vec3 zenith_light() { return mix(vec3(0.010, 0.018, 0.045), vec3(0.10, 0.30, 0.95), day()); }

vec3 horizon_light() {
    vec3 noon = vec3(0.90, 1.35, 1.90), dusk = vec3(1.30, 1.02, 0.80);
    return mix(mix(vec3(0.03, 0.035, 0.06), dusk, smoothstep(-0.15, 0.08, u_sun.z)), noon, smoothstep(0.05, 0.5, u_sun.z));
}

// Air scatters sunlight forward: a glow around the sun, strongest in haze near the horizon.
vec3 glow(vec3 direction) {
    float towards = max(dot(direction, u_sun), 0.0), low = exp(-4.0 * max(direction.z, 0.0));
    return sun_light() * (0.07 * pow(towards, 4.0) * low + 0.10 * pow(towards, 48.0) + 0.2 * pow(towards, 800.0));
}

vec3 air_light(vec3 direction) {
    float height = max(direction.z, 0.0);
    return mix(zenith_light(), horizon_light(), exp(-4.5 * height)) + glow(direction);
}

vec3 sky_light(vec3 direction) {
    float disc = smoothstep(0.99993, 0.99997, dot(direction, u_sun));
    vec3 deep = vec3(1.0 - 0.5 * smoothstep(0.0, 0.8, -direction.z));  // below the horizon, beside the map
    return deep * air_light(direction) + 12.0 * disc * sun_light() * step(0.0, direction.z);
}

// Light of the sky on ground of this normal, as of a white dome: much from the zenith, some from the horizon.
vec3 skylight_on(vec3 normal) {
    return mix(horizon_light(), zenith_light(), 0.5 + 0.25 * normal.z) * (0.5 + 0.5 * normal.z);
}

// Haze lies low: a ray that rises or falls steeply is soon out of it.
vec3 hazed(vec3 light, vec3 direction, float distance_m) {
    float within_m = distance_m / (1.0 + abs(direction.z) * distance_m / (HAZE_THICKNESS * u_haze_m));
    vec3 through = exp(-vec3(0.70, 0.95, 1.35) * within_m / u_haze_m);
    return mix(air_light(vec3(direction.xy, max(direction.z, 0.02))), light, through);
}
