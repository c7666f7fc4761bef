// error/cut.comp — how far the posts of each coarse node's edges lie off the straight lines between its corners. If an
//   edit changes neither these distances nor a vertex of the node, the errors of the node's other posts stay as they
//   are. One thread visits one edge.
// Python twin: reference.cut_moves

#include "error/coarse.glsl"

layout(local_size_x = 64) in;

void main() {
    int i = int(gl_GlobalInvocationID.x), node_ = i >> 2;
    if (node_ >= u_count.x * u_count.y) return;
    ivec2 at = u_first + ivec2(node_ % u_count.x, node_ / u_count.x);
    Move move = cut_edge_m(node_at(u_which_level, at), i & 3);
    int k = cut_index(at) + (i & 3);
    if (move != cut_edge[k]) has_moved[node_] = 1u;
    cut_edge[k] = move;
}
