// rings/edges.glsl — the leaves on both sides of an edge compute the same spacing for it.
//   Where leaves of different sizes meet, the longer side is the edge. Its spacing is the finest among all leaves along
//   it, on both sides. So both sides have the same vertices.
// Provides edge_step_log2(); Edge, edge_of(), next_along().   Python twin: reference.clipmap.edge_step_log2

#include "rings/rings.glsl"

int opposite(int side) { return side ^ 2; }

// The longer of the leaves that meet along a side, and the row of cells just outside it; that row is empty at the map's rim.
struct Edge {
    Leaf leaf;
    int axis;   // along it
    ivec2 at;   // first post of the row
    int end;
};

ivec2 outside(Leaf leaf, int side) {
    ivec2 post = leaf.origin;
    int across = 1 - axis_of(side);
    post[across] += is_far(side) ? 1 << leaf.size_log2[across] : -1;
    return post;
}

Edge edge_of(Leaf leaf, int side) {
    int axis = axis_of(side);
    Leaf other = leaf_over(outside(leaf, side));
    if (is_leaf(other.word) && other.size_log2[axis] > leaf.size_log2[axis]) {
        leaf = other;
        side = opposite(side);
    }
    ivec2 at = outside(leaf, side);
    bool is_on_map = at[1 - axis] >= 0 && at[1 - axis] < u_last_post[1 - axis];
    return Edge(leaf, axis, at, is_on_map ? min(leaf.origin[axis] + (1 << leaf.size_log2[axis]), u_last_post[axis]) : at[axis]);
}

// The leaf over the row's first cell. Afterwards the row begins behind that leaf.
Leaf next_along(inout Edge edge) {
    Leaf other = leaf_over(edge.at);
    edge.at[edge.axis] = max(edge.at[edge.axis] + 1, other.origin[edge.axis] + (1 << other.size_log2[edge.axis]));
    return other;
}

// log2 of the posts between two vertices on a leaf's edge.
int edge_step_log2(Leaf leaf, int side) {
    Edge edge = edge_of(leaf, side);
    int finest = min(step_log2_of(leaf.word), step_log2_of(edge.leaf.word));
    while (edge.at[edge.axis] < edge.end) {
        Leaf other = next_along(edge);
        if (is_leaf(other.word)) finest = min(finest, step_log2_of(other.word));
    }
    return finest;
}
