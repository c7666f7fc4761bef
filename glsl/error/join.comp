// error/join.comp — the coarse levels of the error table: one thread adds one block of posts to its node.
// Python twin: reference.cut_errors

#include "error/coarse.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 2) buffer Gathering { Gathered gathered[]; };  // one entry for each node; zero at the start

void main() {
    ivec2 thread = ivec2(gl_GlobalInvocationID.xy), node_ = thread / blocks_in_node();
    ivec2 block = u_first * blocks_in_node() + thread;
    if (any(greaterThanEqual(node_, u_count)) || any(greaterThanEqual(block, u_level[FINE_LEVELS].size))) return;
    Gathered g = block_of[block_index(block)];
    int i = node_.y * u_count.x + node_.x;
    atomicMax(gathered[i].max_m, g.max_m);
    ATOMIC_ADD_64(gathered[i].squares, uvec2(g.squares[0], g.squares[1]));
    atomicOr(gathered[i].voids, g.voids);
}
