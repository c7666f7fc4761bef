// generate/gully.glsl — stripes that run down a slope, like gullies from erosion, without a simulation of water.
//   Each cell has a pivot, from which waves spread across the slope. The waves of the nine cells around a point are
//   added as vectors and normalised, so that stripes join, fork and end (after Clay John 2018, Eroded Terrain Noise,
//   and Skovbo Johansen 2025).
//
//     slope ↓   │ │ ╲ │ │        The slope of each octave's stripes turns the stripes of the next octave. So these
//               │ │ │╲│ │        run down the sides of the larger gullies, and gullies branch.
//
// Provides stripes().   Python twin: reference.stripes

#include "generate/noise.glsl"

const float REACH = 0.6944444;  // 1 / 1.2²: the nine cells contain all pivots within a distance of 1.2

// Nearly cos(2π turns), from cubic pieces.
float wave(float turns) {
    precise float x = 2.0 * abs(turns - floor(turns + 0.5));
    precise float y = 1.0 - 2.0 * x * x * (3.0 - 2.0 * x);
    return y;
}

// Height and slope of the stripes at p, -1 to 1 each; one stripe for each unit along the unit vector `across`.
vec2 stripes(vec2 p, vec2 across, uint layer) {
    vec2 home = floor(p);
    precise vec2 sum = vec2(0.0);
    for (int j = -1; j <= 1; j++)
        for (int i = -1; i <= 1; i++) {
            vec2 cell = home + vec2(i, j);
            uvec3 h = cell_hash(cell, layer);
            precise vec2 d = p - cell - (0.5 + 0.3 * vec2(signed_unit(h.x), signed_unit(h.y)));
            precise float weight = max(0.0, 1.0 - REACH * dot2(d, d));
            precise float turns = dot2(d, across), quarter = turns + 0.25;
            sum = sum + weight * weight * vec2(wave(turns), wave(quarter));
        }
    precise float length_squared = dot2(sum, sum) + 0.02;
    precise vec2 y = sum * inverse_sqrt(length_squared);
    return y;
}
