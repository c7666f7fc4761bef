// shade/place.glsl — the place on the map that a fragment sees.
// Provides place_in_patch(), is_in_hole().

#include "blocks/terrain.glsl"
#include "mesh/patch.glsl"

// A pixel's centre may be outside the triangle that covers its samples. So we clamp the place to the patch and to the
// map. (Interpolation at samples or centroids would be better, but Mesa's software renderer computes it wrongly.)
vec2 place_in_patch(vec2 post, Patch p) {
    return clamp(post, vec2(p.low), vec2(min(p.high, u_last_post)));
}

#ifndef HOLES
#define HOLES 1  // 0 where voids are filled
#endif

bool is_in_hole(vec2 post) { return HOLES == 1 && is_hole(min(ivec2(post), u_last_post - 1)); }
