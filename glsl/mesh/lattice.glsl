// mesh/lattice.glsl — the positions of a patch's vertices: on posts, or on equal parts of a cell.
//   in_patch.x   column and row of the north-west corner's post, 16 bits each
//   in_patch.y   bits 0-4 log2 of the 64ths of a post between vertices, 5-7 log2 of the segments a side,
//                8-11 split edges (west, north, east, south), 12 fan: edges have one segment, or two where they are
//                split
// Both sides of an edge round to the same integers, so they have the same vertices, bit for bit.
// Provides Lattice, lattice_of(), words_of(), side_of(), place_at().   Python twin: gpu.layout.PATCH

#include "blocks/terrain.glsl"

struct Lattice {
    ivec2 corner;
    int step_log2;  // of 64ths of a post
    int segments;
    uint split_edges;
    bool fan;
};

Lattice lattice_of(uvec2 patch_) {
    return Lattice(ivec2(patch_.x & 0xffffu, patch_.x >> 16), int(patch_.y & 31u), 1 << int(patch_.y >> 5 & 7u),
                   patch_.y >> 8 & 15u, (patch_.y >> 12 & 1u) != 0u);
}

uvec2 words_of(Lattice l) {
    uint segments_log2 = uint(findMSB(l.segments));
    return uvec2(uint(l.corner.x) | uint(l.corner.y) << 16,
                 uint(l.step_log2) | segments_log2 << 5 | l.split_edges << 8 | uint(l.fan) << 12);
}

// Posts along a side.
int side_of(Lattice l) { return (l.segments << l.step_log2) >> 6; }

// In 64ths of a post.
ivec2 place_at(Lattice l, vec2 tess_coord) {
    ivec2 steps = ivec2(round(tess_coord * float(l.segments)));
    return min((l.corner << 6) + (steps << l.step_log2), u_last_post << 6);
}
