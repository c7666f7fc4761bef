// generate/strata.glsl — layers of rock: benches, and cliffs as steep as the rock is hard.
//
//                     ____ bench         The staircase is a function of elevation, so its steps follow the contours.
//            cliff   /                   Each layer breaks at its own level, its hardness changes from place to place,
//          ____ ____|                    and the layers are tilted and wavy.
//
// Provides strata().   Python twin: reference.strata

#include "generate/noise.glsl"

// The new height for `h`, in units of the relief; the hardest cliffs are `edge` times as steep, the softest 2 times.
float strata(float h, vec2 p, float layers, float thickness, float edge, float strength, uint kind) {
    precise vec2 broad = 0.6 * p, wavy = 5.0 * p, rock = 1.3 * p;
    precise float tilt = 0.9 * noise(broad, kind) + 0.15 * noise(wavy, kind + 1u);
    precise float level = h * layers + tilt;
    float layer = floor(level);
    uvec3 own = hash(uvec3(int(layer), kind, u_seed));
    precise float hardness = 0.6 * signed_unit(own.y) + noise(rock, kind + 2u);
    float hard = smooth_step(-0.5, 1.0, hardness);
    precise float x = level - layer - (0.55 + 0.2 * signed_unit(own.x));
    precise float t = min(max(x * blend(2.0, edge, hard) + 0.5, 0.0), 1.0);
    precise float step = 0.3 * (level - layer) + 0.7 * t * t * (2.0 - t);
    precise float terraced = (layer + step - tilt) * thickness;
    precise float share = strength * (0.3 + 0.7 * hard);
    return blend(h, terraced, share);
}
