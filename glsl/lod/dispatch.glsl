// lod/dispatch.glsl — loops whose end only the GPU knows: all rounds are dispatched, and when one of them finds that it was the
// last, those that remain have no groups. So nothing waits for the CPU in between.
// Provides dispatch(), is_over().

#include "lod/summary.glsl"

// Let the passes of further rounds have the groups that they take, or none.
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
