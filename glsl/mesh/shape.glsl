// mesh/shape.glsl — the record of a patch, and the positions of its vertices: on posts, or between them.
//   in_patch.xy  post of the north-west corner; may lie beyond the map
//   in_patch.z   shape: bits 0-4 log2 of the side in posts, 5-10 log2 of the posts between vertices, + 16,
//                11-22 log2 of the segments of each edge, 3 bits each, gl_TessLevelOuter's order
//   in_patch.w   its bound in pixels, float; negative if it has none
// Tessellation levels are powers of two up to 64, so a vertex is on a 64th of the patch's side. Both sides of an edge
// round to the same integers, so their vertices are equal, bit for bit.
// Provides Shape, shape_of(), shape_word(), segments_log2_of(), edges_log2_in(), end_of() and place_of().
// Python twin: gpu.layout.PATCH

#include "blocks/terrain.glsl"

struct Shape {
    ivec2 corner;
    int side_log2;  // log2 of its side in posts
    int step_log2;  // log2 of the posts between its vertices
    ivec4 edges_log2;
};

uint shape_word(int side_log2, int step_log2, ivec4 edges_log2) {
    uint edges = uint(edges_log2[0]) | uint(edges_log2[1]) << 3 | uint(edges_log2[2]) << 6 | uint(edges_log2[3]) << 9;
    return uint(side_log2) | uint(step_log2 + 16) << 5 | edges << 11;
}
int segments_log2_of(uint word) { return int(word & 31u) - (int(word >> 5 & 63u) - 16); }
ivec4 edges_log2_in(uint word) { return ivec4(uvec4(word) >> uvec4(11, 14, 17, 20) & 7u); }

Shape shape_of(ivec4 patch_) {
    uint word = uint(patch_.z);
    int side_log2 = int(word & 31u);
    return Shape(patch_.xy, side_log2, side_log2 - segments_log2_of(word), edges_log2_in(word));
}

ivec2 end_of(Shape s) { return s.corner + (1 << s.side_log2); }

// Place of a vertex, in 64ths of a post.
ivec2 place_of(Shape s, vec2 tess_coord) {
    ivec2 place = (s.corner << 6) + (ivec2(round(tess_coord * 64.0)) << s.side_log2);
    return clamp(place, ivec2(0), u_last_post << 6);
}
