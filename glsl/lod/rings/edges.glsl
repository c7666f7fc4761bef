// lod/rings/edges.glsl — the leaves on both sides of an edge compute the same spacing for it.
//   Where leaves of different sizes meet, one spacing holds along the whole side of the larger leaf: the finest among
//   this leaf and all leaves beyond that side. So the leaves on both sides have the same vertices.
//   A walk visits all leaves along the four edges of a leaf. It is one loop with one look-up: software renderers
//   execute every branch, and every loop at least once.
// Provides look_around_in(), leaf_over(), Walk, START, next_leaf(), edges_log2_of().
// Python twin: reference.rings.edge_step_log2

#include "lod/rings/shapes.glsl"

const Leaf NO_LEAF = Leaf(NOTHING, ivec2(-1 << 28), 0, -1);

// Where leaf_over() looks: the ring of a leaf, the next finer one and the next coarser one. All of the leaf's
// neighbours lie there.
Ring near_finer, near_own, near_coarser;

void look_around_in(int ring) {
    near_finer = u_ring[max(ring - 1, 0)];
    near_own = u_ring[ring];
    near_coarser = u_ring[min(ring + 1, u_rings - 1)];
}

bool is_in(Ring ring, ivec2 post) {
    return all(greaterThanEqual(post, ring.origin)) && all(lessThan(post, ring_end(ring)));
}

// The leaf that covers the cell south-east of a post.
Leaf leaf_over(ivec2 post) {
    Ring ring = near_coarser;
    if (is_in(near_own, post)) ring = near_own;
    if (is_in(near_finer, post)) ring = near_finer;
    if (!is_in(ring, post)) return NO_LEAF;
    ivec2 in_ring = post - ring.origin;
    ivec2 at = in_ring >> (ring.level + 3);
    int block = ring.first_block + at.y * ring.blocks.x + at.x;
    int unit_log2 = ring.level;
    int now = plane(u_agreed);
    ivec2 in_block = in_ring - (at << (ring.level + 3));
    ivec2 unit = in_block >> unit_log2;
    uint word = unit_word[now + UNITS * block + unit.y * 8 + unit.x];
    while ((word & IS_BLOCK) != 0u) {
        in_block -= unit << unit_log2;
        unit_log2 -= 3;
        unit = in_block >> unit_log2;
        block = int(word & ~IS_BLOCK);
        word = unit_word[now + UNITS * block + unit.y * 8 + unit.x];
    }
    int units_log2 = side_units_log2(word);
    ivec2 corner = unit >> units_log2 << units_log2;
    int id = UNITS * block + corner.y * 8 + corner.x;
    return Leaf(word, post - in_block + (corner << unit_log2), unit_log2 + units_log2, id);
}

struct Walk {
    int side;     // where the next leaf meets the leaf that we walk around; 4 at the end
    bool begins;  // whether the next leaf is the first one on that side
    ivec2 at;     // where to look next: in the row of leaves along a side of the longer of two leaves that meet
    int end;      // column or map row where that row of leaves ends
};

const Walk START = Walk(0, true, ivec2(0), 0);

// The first post of the row of cells just outside a side.
ivec2 outside(Leaf leaf, int side) {
    ivec2 post = leaf.origin;
    int across = 1 - axis_of(side);
    post[across] += is_far(side) ? 1 << leaf.side_log2 : -1;
    return post;
}

// Begins the row of leaves along a side of the longer one of two leaves that meet. It is empty at the map's rim.
void begin_row(inout Walk walk, Leaf longer, int side) {
    walk.at = outside(longer, side);
    int axis = axis_of(side);
    int across = walk.at[1 - axis];
    bool is_on_map = across >= 0 && across < u_last_post[1 - axis];
    int end = min(longer.origin[axis] + (1 << longer.side_log2), u_last_post[axis]);
    walk.end = is_on_map ? end : walk.at[axis];
}

// Returns the next leaf and moves on. Where nothing is drawn, is_leaf() of the returned word is false.
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

// The spacing that a leaf itself needs along its edges.
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
