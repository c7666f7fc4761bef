// error/coarse.glsl — large nodes are computed in two steps: one thread for each block of posts, then all blocks of a
//   node together.
//   The results of blocks are kept for every coarse level, so an edit only recomputes the blocks that it touches.
//   The picture shows a node of 4 × 4 blocks. The last block of a row or column, or the last one on the map, also has
//   the posts of the node's far edge:
//      ┌──┬──┬──┬───┐
//      ├──┼██┼──┼───┤
//      └──┴──┴──┴───┘
//   Positive floats compare like their bits, and sums are integers. So the order of the threads does not matter.
// Provides Gathered, block_of[], block_index(), cut_edge[], has_moved[], cut_index(),
// blocks_in_node().
// Python twin: reference.cut_errors

#include "error/cells.glsl"

#define BLOCK (1 << FINE_LEVELS)  // posts a side

struct Gathered {
    uint max_m;       // the bits of a float
    uint squares[2];  // low and high word, fixed point: error/nodes.glsl
    uint voids;
};

layout(std430, binding = 1) buffer Blocks { Gathered block_of[]; };

layout(std430, binding = 5) buffer Cuts { Move cut_edge[]; };  // four of each coarse node: error/coarse.comp
layout(std430, binding = 6) buffer Moved { uint has_moved[]; };  // for each node of this update: whether a cut changed

int cut_index(ivec2 node_) { return 4 * (node_index(u_which_level, node_) - u_level[FINE_LEVELS + 1].first_node); }

// A block of posts is a node of the last fine level.
int block_index(ivec2 block) {
    ivec2 size = u_level[FINE_LEVELS].size;
    return ((u_which_level - FINE_LEVELS - 1) * size.y + block.y) * size.x + block.x;
}

int blocks_in_node() { return 1 << (u_which_level - FINE_LEVELS); }  // along a side
