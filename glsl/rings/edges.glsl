// rings/edges.glsl — both sides of an edge derive its spacing alike.
//   Where leaves of unlike size meet, the longer side is the edge. All leaves along it, on either side, take the finest
//   spacing among them: so both sides have the same vertices.
// Provides edge_step_log2().   Python twin: reference.clipmap.edge_step_log2

#include "rings/rings.glsl"

#define WEST 0  // gl_TessLevelOuter's order
#define NORTH 1
#define EAST 2
#define SOUTH 3

// The finest spacing among the leaves along a side of a square, just outside it.
int finest_outside(ivec2 origin, int side_log2, int side, int finest) {
    int length_ = 1 << side_log2, axis = side == WEST || side == EAST ? 0 : 1;
    ivec2 post = origin;
    post[axis] += side == WEST || side == NORTH ? -1 : length_;
    int end = origin[1 - axis] + length_;
    while (post[1 - axis] < end) {
        Leaf other = leaf_over(post);
        if (is_leaf(other.word)) finest = min(finest, step_log2_of(other.word));
        post[1 - axis] = max(post[1 - axis] + 1, other.origin[1 - axis] + (1 << other.side_log2));
    }
    return finest;
}

int opposite(int side) { return side ^ 2; }

// log2 of the posts between the vertices of a leaf's edge.
int edge_step_log2(Leaf leaf, int side) {
    int own = step_log2_of(leaf.word), axis = side == WEST || side == EAST ? 0 : 1;
    ivec2 post = leaf.origin;
    post[axis] += side == WEST || side == NORTH ? -1 : 1 << leaf.side_log2;
    Leaf other = leaf_over(post);
    if (!is_leaf(other.word) || other.side_log2 <= leaf.side_log2)
        return finest_outside(leaf.origin, leaf.side_log2, side, own);
    return finest_outside(other.origin, other.side_log2, opposite(side), step_log2_of(other.word));
}
