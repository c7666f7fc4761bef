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

    Gathered row = Gathered(0u, 0u, 0u, 0u, NO_SQUARES, 0u, NO_ERRORS, NO_ERRORS);
    uvec2 sums[4] = uvec2[4](uvec2(0u), uvec2(0u), uvec2(0u), uvec2(0u));
    for (int x = first.x; x < end.x; x++) {
        Gathered block = block_of[block_index(ivec2(x, first.y))];
        row.max_q = max(row.max_q, block.max_q);
        row.max_f = max(row.max_f, block.max_f);
        row.cut = max(row.cut, block.cut);
        row.cut_fan = max(row.cut_fan, block.cut_fan);
        row.voids |= block.voids;
        for (int wedge = 0; wedge < 4; wedge++) {
            row.whole[wedge] = max(row.whole[wedge], block.whole[wedge]);
            row.split[wedge] = max(row.split[wedge], block.split[wedge]);
        }
        for (int k = 0; k < 4; k++) sums[k] = add64(sums[k], uvec2(block.squares[2 * k], block.squares[2 * k + 1]));
    }
    int i = node_.y * u_count.x + node_.x;
    atomicMax(gathered[i].max_q, row.max_q);
    atomicMax(gathered[i].max_f, row.max_f);
    atomicMax(gathered[i].cut, row.cut);
    atomicMax(gathered[i].cut_fan, row.cut_fan);
    for (int k = 0; k < 4; k++) add_squares(i, 2 * k, sums[k]);
    atomicOr(gathered[i].voids, row.voids);
    for (int wedge = 0; wedge < 4; wedge++) {
        atomicMax(gathered[i].whole[wedge], row.whole[wedge]);
        atomicMax(gathered[i].split[wedge], row.split[wedge]);
    }
}
