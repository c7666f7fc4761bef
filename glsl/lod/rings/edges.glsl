// lod/rings/edges.glsl — the leaves on both sides of an edge compute the same spacing for it.
//   Where leaves of different sizes meet, the longer side is the edge. Its spacing is the finest among all leaves along
//   it, on both sides. So both sides have the same vertices.
//   A walk visits all leaves along the four edges of a leaf. It is one loop with one look-up: software renderers execute
//   every branch, and every loop at least once.
// Provides Walk, START, next_leaf(), edges_log2_of().   Python twin: reference.rings.edge_step_log2

#include "lod/rings/rings.glsl"

struct Walk {
    int side;     // where the next leaf meets the leaf; 4 at the end
    bool begins;  // whether it is the first one on that side
    ivec2 at;     // the row of cells on the other side of the longer leaf: the first post of what is left
    int end;
};

const Walk START = Walk(0, true, ivec2(0), 0);

// The first post of the row of cells just outside a side.
ivec2 outside(Leaf leaf, int side) {
    ivec2 post = leaf.origin;
    int across = 1 - axis_of(side);
    post[across] += is_far(side) ? 1 << leaf.side_log2 : -1;
    return post;
}

// The row begins outside the longer one of two leaves that meet. It is empty at the map's rim.
void begin_row(inout Walk walk, Leaf longer, int side) {
    walk.at = outside(longer, side);
    int axis = axis_of(side);
    int across = walk.at[1 - axis];
    bool is_on_map = across >= 0 && across < u_last_post[1 - axis];
    int end = min(longer.origin[axis] + (1 << longer.side_log2), u_last_post[axis]);
    walk.end = is_on_map ? end : walk.at[axis];
}

// Goes on to the next leaf; it may be no leaf.
Leaf next_leaf(inout Walk walk, Leaf leaf) {
    int axis = axis_of(walk.side);
    Leaf other = leaf_over(walk.begins ? outside(leaf, walk.side) : walk.at);
    bool is_longer = walk.begins && is_leaf(other.word) && other.side_log2 > leaf.side_log2;
    if (walk.begins) begin_row(walk, is_longer ? other : leaf, is_longer ? walk.side ^ 2 : walk.side);
    if (!is_longer) walk.at[axis] = max(walk.at[axis] + 1, other.origin[axis] + (1 << other.side_log2));
    walk.begins = walk.at[axis] >= walk.end;
    walk.side += int(walk.begins);
    return other;
}

// The spacing that a leaf wants along its edges.
int edge_step_log2(Leaf leaf) {
    int step_log2 = step_log2_of(leaf.word);
    return is_cell_fan(leaf.side_log2, step_log2) ? 0 : step_log2;
}

// log2 of the segments of each edge, in gl_TessLevelOuter's order.
ivec4 edges_log2_of(Leaf leaf) {
    ivec4 steps_log2 = ivec4(edge_step_log2(leaf));
    for (Walk walk = START; walk.side < 4;) {
        int side = walk.side;
        Leaf other = next_leaf(walk, leaf);
        if (is_leaf(other.word)) steps_log2[side] = min(steps_log2[side], edge_step_log2(other));
    }
    return leaf.side_log2 - steps_log2;
}
