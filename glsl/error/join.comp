// error/join.comp — the coarse levels of the error table: one thread adds one block of posts to its node.
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
    ivec2 thread = ivec2(gl_GlobalInvocationID.xy), node_ = thread / blocks_in_node();
    ivec2 block = u_first * blocks_in_node() + thread;
    if (any(greaterThanEqual(node_, u_count)) || any(greaterThanEqual(block, u_level[FINE_LEVELS].size))) return;
    Gathered g = block_of[block_index(block)];
    int i = node_.y * u_count.x + node_.x;
    for (int k = 0; k < MAXIMA; k++) atomicMax(gathered[i].most[k], g.most[k]);
    for (int k = 0; k < 3; k++) add_squares(i, 2 * k, uvec2(g.squares[2 * k], g.squares[2 * k + 1]));
    atomicOr(gathered[i].voids, g.voids);
}
