// error/gather.comp — the coarse levels of the error table: one thread visits one block of its node's posts.
// Python twin: reference.cut_errors

#include "error/coarse.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

uniform ivec4 u_posts;  // the posts that have changed: first column and row, last column and row

bool changes(ivec2 low, ivec2 high) {
    return all(lessThanEqual(low, u_posts.zw)) && all(greaterThanEqual(high, u_posts.xy));
}

// Whether a vertex of the node has changed: then the errors of all posts of the node have changed, too.
bool moves(Node n) {
    for (int i = 0; i < 9; i++) {
        ivec2 post = ivec2(i % 3 == 0 ? n.low.x : i % 3 == 1 ? n.mid.x : n.high.x,
                           i / 3 == 0 ? n.low.y : i / 3 == 1 ? n.mid.y : n.high.y);
        if (changes(post, post)) return true;
    }
    return false;
}

Gathered gathered_of(CellErrors errors) {
    uvec2 sum = square_up(errors.squares_m2 / u_span_m / u_span_m);
    return Gathered(floatBitsToUint(errors.max_m), uint[2](sum.x, sum.y), errors.voids);
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
    // a void makes holes of the cells around it
    if (!has_changed && !changes(low - 1, min(low + BLOCK, n.high))) return;
    int k = cut_index(at);
    CutEdges c = cut_edges_of(cut_edge[k], cut_edge[k + 1], cut_edge[k + 2], cut_edge[k + 3]);

    CellErrors errors = no_errors();
    for (int y = low.y; y < end.y; y++)
        for (int x = low.x; x < end.x; x++) {
            ivec2 place = ivec2(x, y) - n.low;
            gather_post(errors, n, errors_at(n, c, place), place);
        }
    gather_cells(errors, n, c, low - n.low, min(low + BLOCK, n.high) - n.low);
    block_of[block_index(block)] = gathered_of(errors);
}
