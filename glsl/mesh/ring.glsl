// mesh/ring.glsl — the positions of a patch's vertices in the clipmap: on posts, or between them.
//   Tessellation levels are powers of two up to 64, so a vertex is on a 64th of the patch's side. Both sides of an edge
//   round to the same integers, so their vertices are equal, bit for bit.
//   in_patch.xy  post of the north-west corner        .z  its shape (lod/rings/shapes.glsl)        .w  its bound in
//   pixels, float
// Provides RingShape, ring_shape(), place_of().   Python twin: gpu.layout.RING_PATCH

#include "blocks/terrain.glsl"

struct RingShape {
    ivec2 corner;
    int side_log2;  // of its side in posts
    int step_log2;
    ivec4 edges;  // segments: gl_TessLevelOuter's order
};

RingShape ring_shape(ivec4 patch_) {
    uint shape = uint(patch_.z);
    ivec4 edges_log2 = ivec4(shape >> 11, shape >> 14, shape >> 17, shape >> 20) & 7;
    return RingShape(patch_.xy, int(shape & 31u), int(shape >> 5 & 63u) - 16, ivec4(1) << edges_log2);
}

// In 64ths of a post.
ivec2 place_of(RingShape s, vec2 tess_coord) {
    ivec2 place = (s.corner << 6) + (ivec2(round(tess_coord * 64.0)) << s.side_log2);
    return clamp(place, ivec2(0), u_last_post << 6);
}
