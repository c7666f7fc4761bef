// lod/quadtree/dispatch.glsl — loops that the GPU ends itself: the CPU dispatches all rounds.
//   When a round finds that it was the last, it sets the number of groups of all further rounds to 0.
//   So the GPU never waits for the CPU.
// Provides dispatch(), is_over().

#include "lod/quadtree/summary.glsl"

// Set the numbers of work groups of the next round; to 0 if not `on`, which ends the loop.
void dispatch(bool on) {
    for (int j = 0; j <= u_top_level; j++) {
        ivec2 size = u_level[j].size;
        s_groups[j] = uvec4(on ? (size.x + TILE * GROUP - 1) / (TILE * GROUP) : 0, size.y, 1, 0);
    }
    Level top = u_level[u_top_level];
    s_groups[0] = uvec4(on ? (top.first_tile + top.tiles.x * top.tiles.y + GROUP - 1) / GROUP : 0, 1, 1, 0);
    s_groups_of_words = uvec4(on ? (3 * (top.first_word + 1) + GROUP - 1) / GROUP : 0, 1, 1, 0);
}

bool is_over() { return s_groups[0].x == 0u; }
