// error/join.comp — the coarse levels of the error table: one thread reduces one row of its node's blocks.
// Python twins: reference.node_errors, reference.wedge_errors

#include "error/coarse.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 2) buffer Gathering { Gathered gathered[]; };  // one entry for each node; zero at the start

void add_squares(int i, int word, uvec2 more) {
    uint before = atomicAdd(gathered[i].squares[word], more.x);
    uint carry = before + more.x < before ? 1u : 0u;
    atomicAdd(gathered[i].squares[word + 1], more.y + carry);
}

void main() {
    int thread = int(gl_GlobalInvocationID.y);
    ivec2 node_ = ivec2(gl_GlobalInvocationID.x, thread / blocks_in_node());
    if (any(greaterThanEqual(node_, u_count))) return;
    ivec2 first = (u_first + node_) * blocks_in_node() + ivec2(0, thread % blocks_in_node());
    ivec2 end = min(first + blocks_in_node(), u_level[FINE_LEVELS].size);
    if (first.y >= end.y) return;

    Gathered row = Gathered(NO_ERRORS, NO_SQUARES, 0u);
    uvec2 q = uvec2(0u), f = uvec2(0u), c = uvec2(0u);
    for (int x = first.x; x < end.x; x++) {
        Gathered block = block_of[block_index(ivec2(x, first.y))];
        for (int k = 0; k < 11; k++) row.most[k] = max(row.most[k], block.most[k]);
        row.voids |= block.voids;
        q = add64(q, uvec2(block.squares[0], block.squares[1]));
        f = add64(f, uvec2(block.squares[2], block.squares[3]));
        c = add64(c, uvec2(block.squares[4], block.squares[5]));
    }
    int i = node_.y * u_count.x + node_.x;
    for (int k = 0; k < 11; k++) atomicMax(gathered[i].most[k], row.most[k]);
    add_squares(i, 0, q);
    add_squares(i, 2, f);
    add_squares(i, 4, c);
    atomicOr(gathered[i].voids, row.voids);
}
