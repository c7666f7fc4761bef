// error/fine.comp — the fine levels of the error table: one thread visits all posts of its node.
//   On level 1, it computes only nodes that the map's rim cuts off; error/small.comp computes the others.
// Python twin: reference.cut_errors

#include "error/record.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void main() {
    if (any(greaterThanEqual(ivec2(gl_GlobalInvocationID.xy), u_count))) return;
    ivec2 at = u_first + ivec2(gl_GlobalInvocationID.xy);
    Node n = node_at(u_which_level, at);
    CutEdges c = cut_edges_m(n);
    CellErrors errors = no_errors();
    for (int y = 0; y <= n.high.y - n.low.y; y++)
        for (int x = 0; x <= n.high.x - n.low.x; x++) gather_post(errors, n, errors_at(n, c, ivec2(x, y)), ivec2(x, y));
    gather_cells(errors, n, c, ivec2(0), n.high - n.low);
    write_record(at, n, errors);
}
