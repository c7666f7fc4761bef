// generate/land.glsl — height of the land at a point: large forms, gullies, strata, roughness.
//   Lengths on the map are in units of 8 reliefs, heights in units of the relief: slopes do not depend on the relief.
// Provides land().   Python twin: reference.land

#include "generate/gully.glsl"
#include "generate/strata.glsl"

#define ALPINE 1

uniform float u_cliffs;  // 0 to 1
uniform int u_octaves;
uniform int u_recipe;

const float AMPLITUDE[4] = float[](1.0, 0.55, 0.3, 0.17);
const float WARP[3] = float[](0.22, 0.07, 0.03);

// Domain warping (Quilez 2002): p is moved at three scales, so that the lattice of the noise does not show.
vec2 warp(vec2 p) {
    precise vec2 q = p, at = 1.07 * p;
    for (int i = 0; i < 3; i++) {
        precise vec2 beside = at + 0.5;
        q = q + WARP[i] * vec2(noise(at, 2u * uint(i)), noise(beside, 2u * uint(i) + 1u));
        at = finer(at);
        at = 1.4 * at;
    }
    return q;
}

// 0 in the plains, 1 in the uplands.
float upland(vec2 q) {
    precise vec2 a = 0.43 * q, b = 0.93 * q;
    precise float y = noise(a, 7u) + 0.3 * noise(b, 8u);
    return smooth_step(-0.85, 1.0, y);
}

// Distance from the valleys, which are the zero lines of noise; branches fade out into the valleys that they join.
float above_valleys(vec2 q, float softness) {
    precise float sum = 0.0;
    for (int i = 0; i < min(4, u_octaves); i++) {
        precise float held = i == 0 ? 1.0 : min(1.0, 2.0 * sum);
        precise float soft = softness * AMPLITUDE[i];
        sum = sum + held * AMPLITUDE[i] * soft_abs(noise(q, 10u + uint(i)), soft);
        q = finer(q);
    }
    return sum;
}

// Distance from canyons. Branches are shallower than the canyons that they join, but as steep.
float branches(vec2 q) {
    precise float nearest = 1.0;
    for (int i = 0; i < min(3, u_octaves); i++) {
        precise float here = 0.07 * float(i) + AMPLITUDE[i] * soft_abs(noise(q, 10u + uint(i)), 0.06);
        nearest = soft_min(nearest, here);
        q = finer(q);
    }
    return nearest;
}

// Ridged multifractal (Musgrave, in Ebert et al. 2003): crests at the zero lines, rougher where they are higher.
float ridges(vec2 q) {
    precise float sum = 0.0, held = 1.0;
    for (int i = 0; i < min(4, u_octaves); i++) {
        precise float crest = 1.0 - soft_abs(noise(q, 20u + uint(i)), 0.1);
        precise float rise = held * crest * crest;
        sum = sum + AMPLITUDE[i] * rise;
        held = min(1.0, 1.5 * rise);
        q = finer(q);
    }
    return sum;
}

// From rolling hills to tablelands: plateaus with mesas, and plains where valleys are wide.
float canyon(vec2 p) {
    vec2 q = warp(p);
    float up = upland(q);
    float t = above_valleys(q, blend(0.25, 0.12, u_cliffs));
    precise float hills = 0.06 + 0.24 * up + (0.36 + 0.24 * up) * t;
    precise float eaten = (0.45 + 2.2 * t) * branches(q) - 0.2 * (1.0 - up);
    precise float table = (0.38 + 0.12 * up) * smooth_step(0.03, 4.0, eaten) + 0.22 * smooth_step(0.34, 5.0, eaten);
    precise float tableland = 0.08 + 0.08 * t + table;
    return blend(hills, tableland, u_cliffs * u_cliffs);
}

// Ranges of ridges between plains.
float alpine(vec2 p) {
    vec2 q = warp(p);
    float up = upland(q);
    precise vec2 close = 1.6 * q;
    precise float y = 0.05 + 0.08 * above_valleys(q, 0.2) + 0.1 * up + (0.05 + 0.3 * up) * ridges(close);
    return y;
}

float forms(vec2 p) { return u_recipe == ALPINE ? alpine(p) : canyon(p); }

// Slope of the large forms, east and south.
vec2 rise(vec2 p, float h) {
    precise vec2 east = p + vec2(1.0 / 256.0, 0.0), south = p + vec2(0.0, 1.0 / 256.0);
    precise vec2 y = (vec2(forms(east), forms(south)) - h) * 256.0;
    return y;
}

// Height of the land, 0 to 1. Gullies are deep on steep land, and there are none on plains.
// Each octave of gullies follows the slope of the octave before.
float land(vec2 p) {
    precise float h = forms(p), rough = 0.0, wavelength = 0.2, frequency = 5.0;
    precise vec2 slope = rise(p, h);
    float hillside = smooth_step(0.0, 1.0, dot2(slope, slope));
    precise float carving = blend(0.07, 0.13, min(1.0, 1.5 * u_cliffs)) * smooth_step(0.0, 5.0, h);
    for (int k = 3; k < u_octaves; k++) {
        precise float square = dot2(slope, slope), inverse = inverse_sqrt(square + 0.1);
        precise float steep = min(square * inverse, 4.0);
        precise vec2 across = vec2(-slope.y, slope.x) * inverse, at = p * frequency, rough_at = 1.7 * at;
        vec2 gully = stripes(at, across, 40u + uint(k));
        precise float depth = carving * steep * smooth_step(0.0, 1.0, steep);
        h = h + depth * wavelength * gully.x;
        rough = rough + (0.02 + 0.03 * steep) * wavelength * noise(rough_at, 60u + uint(k));
        slope = slope + 5.0 * depth * gully.y * across;
        wavelength = 0.5 * wavelength;
        frequency = 2.0 * frequency;
    }
    precise float bold = min(1.0, 1.2 * u_cliffs) * hillside, ledges = 0.6 * u_cliffs * hillside;
    h = strata(h, p, 6.0, 1.0 / 6.0, 16.0, bold, 80u);
    h = strata(h, p, 27.0, 1.0 / 27.0, 5.0, ledges, 90u);
    precise float y = min(max(0.02 + 0.92 * (h + rough), 0.0), 1.0);
    return y;
}
