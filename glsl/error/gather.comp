// error/gather.comp — the error table's coarse levels: a thread looks at one block of its node's posts.
//   A node of 4 × 4 blocks; the last block of a row or column also has the node's far edge:
//      ┌──┬──┬──┬───┐
//      ├──┼██┼──┼───┤
//      └──┴──┴──┴───┘

#include "error/coarse.glsl"

#ifndef BLOCK
#define BLOCK 32
#endif

layout(local_size_x = 8, local_size_y = 8) in;

void add_squares(int i, int word, float squares) {
    uvec2 more = square_up(squares / u_span_m / u_span_m);
    uint before = atomicAdd(gathered[i].squares[word], more.x);
    uint carry = before + more.x < before ? 1u : 0u;
    atomicAdd(gathered[i].squares[word + 1], more.y + carry);
}

void main() {
    int blocks = (1 << u_which_level) / BLOCK;
    ivec2 thread = ivec2(gl_GlobalInvocationID.xy), at = u_first + thread / blocks, block = thread % blocks;
    if (any(greaterThanEqual(thread / blocks, u_count))) return;
    Node n = node_at(u_which_level, at);
    ivec2 low = n.low + block * BLOCK;
    ivec2 end = min(low + BLOCK + ivec2(equal(block, ivec2(blocks - 1))), n.high + 1);
    Worst w = worst_of_nothing();
    for (int y = low.y; y < end.y; y++)
        for (int x = low.x; x < end.x; x++) gather_post(w, n, ivec2(x, y));

    int i = gathered_index(at);
    atomicMax(gathered[i].max_q, floatBitsToUint(w.max_m.x));
    atomicMax(gathered[i].max_f, floatBitsToUint(w.max_m.y));
    add_squares(i, 0, w.squares.x);
    add_squares(i, 2, w.squares.y);
    atomicOr(gathered[i].voids, w.voids);
}
