// error/gather.comp — the coarse levels of the error table: one thread visits one block of its node's posts.
// Python twins: reference.node_errors, reference.wedge_errors

#include "error/coarse.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

uniform ivec4 u_posts;  // the posts that have changed: first column and row, last column and row

bool holds(ivec2 low, ivec2 high) {
    return all(lessThanEqual(low, u_posts.zw)) && all(greaterThanEqual(high, u_posts.xy));
}

// Whether a post at a vertex of the node has changed: then the errors of all its posts have.
bool moves(Node n) {
    for (int i = 0; i < 9; i++) {
        ivec2 post = ivec2(i % 3 == 0 ? n.low.x : i % 3 == 1 ? n.mid.x : n.high.x,
                           i / 3 == 0 ? n.low.y : i / 3 == 1 ? n.mid.y : n.high.y);
        if (holds(post, post)) return true;
    }
    return false;
}

void main() {
    ivec2 thread = ivec2(gl_GlobalInvocationID.xy), in_node = thread % blocks_in_node();
    ivec2 at = u_first + thread / blocks_in_node(), block = at * blocks_in_node() + in_node;
    if (any(greaterThanEqual(thread / blocks_in_node(), u_count))) return;
    if (any(greaterThanEqual(block, u_level[FINE_LEVELS].size))) return;
    Node n = node_at(u_which_level, at);
    ivec2 low = block * BLOCK, end = min(low + BLOCK, n.high);
    end += ivec2(equal(end, n.high));  // the far edge
    bool has_changed = has_moved[(at.y - u_first.y) * u_count.x + at.x - u_first.x] != 0u || moves(n);
    if (!has_changed && !holds(low, min(low + BLOCK, n.high))) return;
    int k = cut_index(at);
    CutEdges c = cut_edges_of(n, cut_edge[k], cut_edge[k + 1], cut_edge[k + 2], cut_edge[k + 3]);

    Worst w = worst_of_nothing();
    for (int y = low.y; y < end.y; y++)
        for (int x = low.x; x < end.x; x++) gather_post(w, n, errors_at(n, c, ivec2(x, y) - n.low), ivec2(x, y) - n.low);
    gather_cells(w, n, c, low - n.low, min(low + BLOCK, n.high) - n.low);
    vec4 share = w.squares / u_span_m / u_span_m;
    uvec4 most = floatBitsToUint(vec4(w.max_m, w.cut_m)), whole = floatBitsToUint(w.whole_m), split = floatBitsToUint(w.split_m), turned = floatBitsToUint(w.turned_m);
    uvec2 q = square_up(share.x), f = square_up(share.y), c2 = square_up(share.z), f2 = square_up(share.w);
    uint[16] errors = uint[16](most.x, most.y, most.z, most.w, whole.x, whole.y, whole.z, whole.w, split.x, split.y, split.z, split.w, turned.x, turned.y, turned.z, turned.w);
    block_of[block_index(block)] = Gathered(errors, uint[8](q.x, q.y, f.x, f.y, c2.x, c2.y, f2.x, f2.y), w.voids);
}
