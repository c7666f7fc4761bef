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
        for (int x = low.x; x < end.x; x++) gather_post(w, n, c, ivec2(x, y));
    gather_cells(w, n, c, low, min(low + BLOCK, n.high));
    uvec2 max_m = floatBitsToUint(w.max_m);
    vec4 share = w.squares / u_span_m / u_span_m;
    Gathered g = Gathered(max_m.x, max_m.y, floatBitsToUint(w.cut_m.x), floatBitsToUint(w.cut_m.y), NO_SQUARES, w.voids, NO_ERRORS, NO_ERRORS);
    for (int i = 0; i < 4; i++) {
        uvec2 fixed_ = square_up(share[i]);
        g.squares[2 * i] = fixed_.x;
        g.squares[2 * i + 1] = fixed_.y;
    }
    for (int wedge = 0; wedge < 4; wedge++) {
        g.whole[wedge] = floatBitsToUint(w.whole_m[wedge]);
        g.split[wedge] = floatBitsToUint(w.split_m[wedge]);
    }
    block_of[block_index(block)] = g;
}
