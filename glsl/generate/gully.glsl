// generate/gully.glsl — stripes that run down a slope: what running water leaves, without the water.
//   Each cell has a pivot from which waves spread across the slope; the waves of the nine cells around are added as
//   arrows and brought to one length, so that stripes join up, fork and end (the idea of Clay John 2018, Eroded Terrain
//   Noise, and of Skovbo Johansen 2025).
//
//     slope ↓   │ │ ╲ │ │        Octave by octave the stripes' own slope turns the next ones, which so run
//               │ │ │╲│ │        down the sides of the last: gullies branch.
//
// Provides stripes().   Python twin: reference.stripes

#include "generate/noise.glsl"

const float REACH = 0.6944444;  // 1 / 1.2², within which the nine cells hold all pivots

// Much like cos(2π turns), of cubic pieces.
float wave(float turns) {
    precise float x = 2.0 * abs(turns - floor(turns + 0.5));
    precise float y = 1.0 - 2.0 * x * x * (3.0 - 2.0 * x);
    return y;
}

// Height and rise of the stripes at p, -1 to 1 each, one stripe a unit along the unit vector `across`.
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
