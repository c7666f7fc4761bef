// shade/place.glsl — the place on the map that a fragment of a patch sees.
// Provides place_in_patch(), is_in_hole().

#include "blocks/terrain.glsl"
#include "mesh/patch.glsl"

// A pixel's centre may lie beside the triangle that covers its samples: do not leave the patch, nor the map.
// (Interpolation at samples or centroids is for just that, but Mesa's software renderer gets it wrong.)
vec2 place_in_patch(vec2 post, Patch p) {
    return clamp(post, vec2(p.low), vec2(min(p.high, u_last_post)));
}

#ifndef HOLES
#define HOLES 1  // 0 where voids are filled
#endif

bool is_in_hole(vec2 post) { return HOLES == 1 && is_hole(min(ivec2(post), u_last_post - 1)); }
