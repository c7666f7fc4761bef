// lod/agree.comp — neighbours agree on the edges between them: a leaf that is too coarse as it stands asks for what it lacks.
//   A fan's wedges err by themselves, each with its edge whole or split. Where a wedge is too coarse with its edge whole,
//   but not with it split, the edge is cut: one triangle more here and one in the neighbour of the same size, instead of a
//   split into four. Only where that does not help, or a neighbour is coarser, the leaf asks to be split itself.
//
//        ┌───────┬───────┐          ┌───────┬───────┐         (Each vertex for itself: Lindstrom, Koller, Ribarsky,
//        │ ╲   ╱ │       │          │ ╲   ╱ │     ╱ │         Hodges, Faust, Turner 1996, "Real-time, continuous level
//        │   ╳   │       │    →     │   ╳───┼───╳   │         of detail rendering of height fields".)
//        │ ╱   ╲ │       │          │ ╱   ╲ │     ╲ │
//        └───────┴───────┘          └───────┴───────┘
//
//   All ask what the round before left them, and lod/commit.comp grants it: the order of the threads does not matter. Edges
//   and splits are only ever added, so that the rounds come to an end; then every leaf passes with its very edges.
// A group of 32 threads is a tile, a thread one of its rows.
// Python twin: reference.lod.agree

#include "lod/leaf.glsl"
#include "lod/tiles.glsl"

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
        if (beyond_help != 0u) ask_for_split(level, at);
        else if (lacking != 0u) ask_for_edges(level, at, lacking);
    }
}
