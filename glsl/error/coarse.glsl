// error/coarse.glsl — the buffers of error/coarse.comp. Levels up to FINE_LEVELS are fine, the others are coarse. Here,
//   a fine node is a node of level FINE_LEVELS. A coarse node has the errors of all posts of the fine nodes under it.
//   One thread visits the posts of a fine node, and its contribution is kept for every coarse level. So an edit
//   recomputes only the contributions that it touches. Each post counts in one fine node. The posts of a coarse node's
//   south and east edges count in its last row and its last column of fine nodes.
// Provides Gathered, contribution[], contribution_index(), cut_edge[], has_changed[], cut_index(), fine_in_node().
// Python twin: reference.cut_errors

#include "error/cells.glsl"

#define FINE_SIDE (1 << FINE_LEVELS)  // posts a side of a node of the last fine level

struct Gathered {
    uint max_m;       // the bits of a float
    uint squares[2];  // low and high word, fixed point: error/nodes.glsl
    uint voids;
};

layout(std430, binding = 1) buffer Contributions { Gathered contribution[]; };

layout(std430, binding = 5) buffer Cuts { CutEdge cut_edge[]; };  // four of each coarse node: error/coarse.comp
layout(std430, binding = 6) buffer Changed { uint has_changed[]; };  // whether an edge has, for each node of the update

int cut_index(ivec2 node_) { return 4 * (node_index(u_which_level, node_) - u_level[FINE_LEVELS + 1].first_node); }

// The contribution of a fine node to the node over it.
int contribution_index(ivec2 fine) {
    ivec2 size = u_level[FINE_LEVELS].size;
    return ((u_which_level - FINE_LEVELS - 1) * size.y + fine.y) * size.x + fine.x;
}

int fine_in_node() { return 1 << (u_which_level - FINE_LEVELS); }  // along a side
