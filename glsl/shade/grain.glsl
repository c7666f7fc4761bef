// shade/grain.glsl — detail below the posts' spacing: bumps and specks in the shading, without geometry.
//   Five octaves of value noise, 2 to 89 bumps between two posts. An octave whose bumps are smaller than a pixel's
//   footprint fades to its mean, which is 0. So near the eye there is grain, and far away the light is the same as
//   without grain. The noise is a function of the post number, so a map has the same grain at any distance.
// Provides GRAIN, Grain, grain_of(), grain_strength().

#include "shade/cover.glsl"

#ifndef GRAIN
#define GRAIN 0  // 1 where grain is drawn
#endif

struct Grain {
    vec2 slope;   // metres up per metre east, north
    float speck;  // the albedo is higher by this share, or lower if it is negative
};

const int BUMPS[5] = int[5](2, 5, 13, 34, 89);  // between two posts

Grain grain_of(vec2 post, vec2 extent, float strength) {
    Grain g = Grain(vec2(0.0), 0.0);
    if (GRAIN == 0 || strength <= 0.0) return g;
    ivec2 at = ivec2(floor(post));
    for (int k = 0; k < 5; k++) {
        vec2 p = fract(post) * float(BUMPS[k]);
        float seen = seen_noise(extent * float(BUMPS[k]));
        if (seen <= 0.0) break;
        vec3 b = bump(at * BUMPS[k] + ivec2(floor(p)) + 7919 * k, fract(p))
            * (seen * strength * (1.0 - 0.12 * float(k)));
        g.slope += vec2(b.x, -b.y);
        g.speck += 1.2 * b.z;
    }
    return g;
}

// Rock is rough, meadows less so, and snow hardly. Water, filled voids and diagrams are smooth.
float grain_strength(vec2 post, float steep, vec3 albedo) {
    if (GRAIN == 0 || LOOK >= GREY) return 0.0;
    vec2 marked = MARKED ? marked_at(post) : vec2(0.0);
    float bright = smoothstep(0.45, 0.75, albedo.g);
    return mix(0.16, 0.42, smoothstep(0.25, 0.9, steep)) * (1.0 - 0.75 * bright) * (1.0 - max(marked.x, marked.y));
}
