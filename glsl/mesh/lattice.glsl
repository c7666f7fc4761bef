// mesh/lattice.glsl — where a patch's vertices stand: on posts; or, for the centre of a cell drawn as a fan, amid four.
//   in_patch.x   column and row of the north-west corner's post, 16 bits each
//   in_patch.y   bits 0-3 log2 of the half posts between vertices, 4-6 log2 of the segments a side,
//                8-11 split edges (west, north, east, south), 12 fan
// Both sides of an edge round to the same integers, so they have the same vertices to the bit.
// Provides Lattice, lattice_of(), halves_at().   Python twin: layout.PATCH

#include "blocks/terrain.glsl"

struct Lattice {
    ivec2 corner;
    int step_log2;  // of half posts
    int segments;
    uint split_edges;
    bool fan;
};

Lattice lattice_of(uvec2 patch_) {
    return Lattice(ivec2(patch_.x & 0xffffu, patch_.x >> 16), int(patch_.y & 15u), 1 << int(patch_.y >> 4 & 7u),
                   patch_.y >> 8 & 15u, (patch_.y >> 12 & 1u) != 0u);
}

// In half posts.
ivec2 halves_at(Lattice l, vec2 tess_coord) {
    ivec2 steps = ivec2(round(tess_coord * float(l.segments)));
    return min(2 * l.corner + (steps << l.step_log2), 2 * u_last_post);
}
