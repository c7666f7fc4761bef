// lod/quadtree/agree.comp — leaves over tolerance ask to split edges that they share with neighbours.
//   Each wedge of a fan has its own errors, with its edge whole and with it split.
//   If a wedge is over tolerance with its edge whole, but not with it split, the leaf asks to split the edge.
//   That costs one triangle here and one in the neighbour of the same size, instead of a split into four.
//   If no edge helps, or the neighbour is coarser, the leaf asks to be split.
//
//        ┌───────┬───────┐          ┌───────┬───────┐         (Each vertex on its own: Lindstrom, Koller, Ribarsky,
//        │ ╲   ╱ │       │          │ ╲   ╱ │     ╱ │         Hodges, Faust, Turner 1996, "Real-time, continuous level
//        │   ╳   │       │    →     │   ╳───┼───╳   │         of detail rendering of height fields".)
//        │ ╱   ╲ │       │          │ ╱   ╲ │     ╲ │
//        └───────┴───────┘          └───────┴───────┘
//
//   All leaves look at the tree of the last round, and lod/quadtree/commit.comp applies the requests afterwards.
//   So the order of the threads does not matter. Edges and splits are only added, never removed, so the rounds end.
//   A group of 32 threads processes one tile, each thread one of its rows.
// Python twin: reference.quadtree.agree

#include "lod/quadtree/leaf.glsl"
#include "lod/quadtree/tiles.glsl"

layout(local_size_x = TILE) in;

// Wedges (bits W, N, E, S) that are too coarse with these errors.
uint too_coarse(Projection p, vec4 errors_m, float limit_px) {
    uint bits = 0u;
    for (int i = 0; i < 4; i++) bits |= uint(metric_px(p, errors_m[i], errors_m[i]) > limit_px) << i;
    return bits;
}

void main() {
    uint group = gl_WorkGroupID.y * uint(MANY) + gl_WorkGroupID.x;
    if (group >= active_groups.w) return;
    ivec3 tile = tile_at(int(active_tile[group]));
    int level = tile.z, word = tile.x, y = TILE * tile.y + int(gl_LocalInvocationIndex);
    if (level == 0 || y >= u_level[level].size.y) return;

    float limit_px = u_tolerance_px * STRICTER;
    uvec4 finer = finer_neighbours(level, word, y), alike = alike_neighbours(level, word, y);
    for (uint left = existing_word(level, word, y) & ~split_word(level, word, y); left != 0u; left &= left - 1u) {
        ivec2 at = ivec2(32 * word + findLSB(left), y);
        Projection p = project_node(level, at, 2.0);
        if (p.outside) continue;
        PackedNode n = node_of(level, at);
        if (all(equal(finer >> (at.x & 31) & 1u, uvec4(0u))) && quad_px(p, n) <= limit_px) continue;

        uint edges = split_edges(finer, level, at), open = split_edges(alike, level, at);
        uint lacking = too_coarse(p, wedges_m(n, n.whole), limit_px) & ~edges;
        uint beyond_help = too_coarse(p, wedges_m(n, n.split), limit_px) & (edges | lacking) | lacking & ~open;
        if (beyond_help != 0u) ask_for(0, level, at);
        else if (lacking != 0u) ask_for_edges(level, at, lacking);
    }
}
