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

    Gathered row = nothing_gathered();
    uvec2 sums[3] = uvec2[3](uvec2(0u), uvec2(0u), uvec2(0u));
    for (int x = first.x; x < end.x; x++) {
        Gathered block = block_of[block_index(ivec2(x, first.y))];
        for (int k = 0; k < MAXIMA; k++) row.most[k] = max(row.most[k], block.most[k]);
        row.voids |= block.voids;
        for (int k = 0; k < 3; k++)
            sums[k] = add64(sums[k], uvec2(block.squares[2 * k], block.squares[2 * k + 1]));
    }
    int i = node_.y * u_count.x + node_.x;
    for (int k = 0; k < MAXIMA; k++) atomicMax(gathered[i].most[k], row.most[k]);
    for (int k = 0; k < 3; k++) add_squares(i, 2 * k, sums[k]);
    atomicOr(gathered[i].voids, row.voids);
}
