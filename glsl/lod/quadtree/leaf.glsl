// lod/quadtree/leaf.glsl — how a leaf is drawn: as a quad (two triangles), or as a fan of 4 to 8 triangles around its
//   centre. It is a quad if no neighbour is finer, and if the quad is within the tolerance; with a budget, if a fan is
//   not worth its triangles. An edge of a fan is split if the neighbour is finer.
// Provides finer_neighbours(), split_edges(), fan_triangles(), draws_as_quad().
// Python twin: reference.select

#include "lod/quadtree/price.glsl"

// The nodes of a word whose west, north, east and south edges are split (the order of gl_TessLevelOuter), because the
// neighbour is finer, or because both nodes agreed to split the edge.
uvec4 finer_neighbours(int level, int word, int y) {
    uint own = split_word(level, word, y), west = cut_word(CUT_WEST, level, word, y);
    uint next_own = split_word(level, word + 1, y);
    uint next_west = cut_word(CUT_WEST, level, word + 1, y);
    return uvec4(own << 1 | split_word(level, word - 1, y) >> 31 | west,
                 split_word(level, word, y - 1) | cut_word(CUT_NORTH, level, word, y),
                 own >> 1 | next_own << 31 | west >> 1 | next_west << 31,
                 split_word(level, word, y + 1) | cut_word(CUT_NORTH, level, word, y + 1));
}

uint safe_existing_word(int level, int word, int y) {
    return has_word(level, word, y) ? existing_word(level, word, y) : 0u;
}

// The nodes with neighbours of their own size in the west, north, east and south.
uvec4 alike_neighbours(int level, int word, int y) {
    uint own = existing_word(level, word, y);
    return uvec4(own << 1 | safe_existing_word(level, word - 1, y) >> 31, safe_existing_word(level, word, y - 1),
                 own >> 1 | safe_existing_word(level, word + 1, y) << 31, safe_existing_word(level, word, y + 1));
}

// Whether a fan's centre is on the map's last column, and on its last row.
bvec2 on_rim(int level, ivec2 at) { return greaterThanEqual((2 * at + 1) << (level - 1), u_last_post); }

// The split edges of a fan. If the fan's centre is on the map's rim, two edges end there, in their middle: not split.
uint split_edges(uvec4 finer, int level, ivec2 at) {
    uvec4 bits = finer >> (at.x & 31) & 1u;
    bvec2 rim = on_rim(level, at);
    if (rim.x) bits.yw = uvec2(0u);
    if (rim.y) bits.xz = uvec2(0u);
    return bits.x | bits.y << 1 | bits.z << 2 | bits.w << 3;
}

// Wedges beyond the map's rim have no area.
uint fan_triangles(uint edges, int level, ivec2 at) {
    bvec2 rim = on_rim(level, at);
    return 4u + uint(bitCount(edges)) - uint(rim.x) - uint(rim.y);
}

// Whether a leaf without finer neighbours is drawn as a quad.
bool draws_as_quad(Projection p, PackedNode n, int level, ivec2 at) {
    if (p.outside) return true;
    if (has_budget()) return quad_pays(p, n, level, at, float(fan_triangles(0u, level, at)));
    return quad_px(p, n) <= u_tolerance_px;
}
