// error/gather.comp — the error table's coarse levels: a work group looks at one block of a node's posts.
//   Block 3 of a node of 4 × 4 blocks, and the posts of one thread in it:
//      ┌──┬──┬──┬██┐        ┌ · · · · ┐
//      ├──┼──┼──┼──┤        │ · • · • │  every 16th post of every 16th row
//      ├──┼──┼──┼──┤        │ · · · · │
//      └──┴──┴──┴──┘        └ · • · • ┘

#include "error/coarse.glsl"

#define BLOCK 64

layout(local_size_x = 16, local_size_y = 16) in;

shared Worst s_worst[256];

void join(inout Worst a, Worst b) {
    a.max_m = max(a.max_m, b.max_m);
    a.squares_q = add64(a.squares_q, b.squares_q);
    a.squares_f = add64(a.squares_f, b.squares_f);
    a.voids |= b.voids;
}

void add_squares(int i, int word, uvec2 squares) {
    uint before = atomicAdd(gathered[i].squares[word], squares.x);
    uint carry = before + squares.x < before ? 1u : 0u;
    atomicAdd(gathered[i].squares[word + 1], squares.y + carry);
}

void main() {
    int side = min(1 << u_which_level, BLOCK), blocks = (1 << u_which_level) / side;
    ivec2 at = u_first + ivec2(gl_WorkGroupID.xy) / blocks, block = ivec2(gl_WorkGroupID.xy) % blocks;
    Node n = node_at(u_which_level, at);
    ivec2 low = n.low + block * side;
    ivec2 end = min(low + side + ivec2(equal(block, ivec2(blocks - 1))), n.high + 1);

    Worst w = worst_of_nothing();
    for (int y = low.y + int(gl_LocalInvocationID.y); y < end.y; y += 16)
        for (int x = low.x + int(gl_LocalInvocationID.x); x < end.x; x += 16) gather_post(w, n, ivec2(x, y));

    uint thread = gl_LocalInvocationIndex;
    s_worst[thread] = w;
    for (uint half_width = 128u; half_width > 0u; half_width /= 2u) {
        barrier();
        if (thread < half_width) join(s_worst[thread], s_worst[thread + half_width]);
    }
    if (thread != 0u) return;
    w = s_worst[0];
    int i = gathered_index(at);
    atomicMax(gathered[i].max_q, floatBitsToUint(w.max_m.x));
    atomicMax(gathered[i].max_f, floatBitsToUint(w.max_m.y));
    add_squares(i, 0, w.squares_q);
    add_squares(i, 2, w.squares_f);
    atomicOr(gathered[i].voids, w.voids);
}
