// error/small.comp — nodes of 2 × 2 or 4 × 4 cells that the map's rim does not cut off. All loops have constant bounds. So compilers unroll them,
// compute weights, read each height once, and keep the errors at each post for the four cells around it.
// Python twins: reference.node_errors, reference.wedge_errors

#define WHOLE_NODES
#include "error/record.glsl"

#define SIDE (1 << LEVEL)
#define ROW (SIDE + 1)
#if LEVEL == 1
const ivec2 CELLS[4] = ivec2[4](ivec2(0, 0), ivec2(1, 1), ivec2(0, 1), ivec2(1, 0));
#else
const ivec2 CELLS[8] = ivec2[8](ivec2(0, 0), ivec2(1, 1), ivec2(2, 2), ivec2(3, 3), ivec2(0, 3), ivec2(1, 2), ivec2(2, 1), ivec2(3, 0));
#endif

layout(local_size_x = 8, local_size_y = 8) in;

void main() {
    if (any(greaterThanEqual(ivec2(gl_GlobalInvocationID.xy), u_count))) return;
    ivec2 at = u_first + ivec2(gl_GlobalInvocationID.xy);
    Node n = node_at(LEVEL, at);
    CutEdges c = cut_edges_m(n);
    Worst w = worst_of_nothing();
    PostErrors e[ROW * ROW];
    for (int i = 0; i < ROW * ROW; i++) {
        ivec2 place = ivec2(i % ROW, i / ROW);
        e[i] = errors_at(n, c, place);
        gather_post(w, n, e[i], place);
    }
    for (int i = 0; i < 2 * SIDE; i++) {  // first the cells of the falling diagonal
        ivec2 cell = CELLS[i];
        int a = cell.y * ROW + cell.x, b = a + 1, c = a + ROW, d = c + 1;
        bool is_whole = !is_hole(n.low + cell);
        if (is_whole && i < SIDE) gather_cell(w, n, e[a], e[d], e[b], e[c], vec2(0.0));
        if (is_whole && i >= SIDE) gather_cell(w, n, e[c], e[b], e[d], e[a], vec2(0.0));
    }
    settle_node(at, n, w);
}
