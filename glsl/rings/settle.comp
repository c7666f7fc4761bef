// rings/settle.comp — a round of neighbours: leaves next to finer ones.
//   A finer neighbour divides the common edge. Then the strip along the edge may have a larger error (rings/strip.glsl).
//   If that is not within the tolerance, a large leaf is split in four, and the parts along the edge become finer; a small
//   leaf becomes finer as a whole. A leaf is also split if the edge would need more than 64 segments.
//   All threads read the leaves as the round before left them, so the order of threads does not matter. Leaves only become
//   finer, so the rounds end. The first round visits all leaves; later rounds visit leaves that have changed and their
//   neighbours.   One thread handles one leaf.

#include "rings/leaf.glsl"
#include "rings/lists.glsl"
#include "rings/edges.glsl"
#include "rings/strip.glsl"

layout(local_size_x = LEAF_GROUP) in;

uniform bool u_budget;  // no tolerance: only edges of more than 64 segments matter

#define SPLIT 0x10000000u
#ifndef SPLIT_FROM
#define SPLIT_FROM 2  // log2 of segments a side: leaves with at least so many are split, smaller ones become finer as a whole
#endif

// Whether a leaf is within the tolerance with these edges. If a leaf of one segment has a finer edge, OpenGL draws it as a
// fan around a vertex in its middle. The tables have no bound for that, except in a cell of the map, where the fan is
// closer to the truth (|t|/16).
bool keeps_tolerance(Leaf leaf, ivec4 edge_steps_log2, Projection p) {
    int step_log2 = step_log2_of(leaf.word);
    if (step_log2 <= 0) return true;
    if (any(lessThan(edge_steps_log2, ivec4(step_log2))) && leaf.side_log2 == step_log2) return false;
    if (u_budget) return true;
    if (has_mean(p)) return leaf_px(leaf, edge_steps_log2, p) <= u_tolerance_px;
    float within_m = error_within_m(p);
    for (int side = 0; side < 4; side++) {
        ivec4 strip = strip_of(leaf, side);
        if (!is_strip(strip, step_log2, edge_steps_log2[side])) continue;
        float left_m = within_m - edge_move_m(leaf, side, edge_steps_log2[side]);
        if (left_m <= 0.0 || !is_within_m(strip.xy, strip.zw, step_log2, left_m)) return false;
    }
    return true;
}

// The leaf's word, with a finer spacing if necessary; with SPLIT if no spacing is enough.
uint judge(Leaf leaf, int ring, bool can_split) {
    int own = step_log2_of(leaf.word), finest = own, units_log2 = side_units_log2(leaf.word);
    ivec4 edge;
    for (int side = 0; side < 4; side++) finest = min(finest, edge[side] = edge_step_log2(leaf, side));
    if (finest == own) return leaf.word;
    if (leaf.side_log2 - finest > MOST_SEGMENTS_LOG2) return can_split ? leaf.word | SPLIT : leaf.word;
    int level;
    // only finer posts can reduce its error; but it must not be a fan
    if (is_waiting(leaf.origin, leaf.side_log2, level) && own <= level)
        return leaf.side_log2 == own && own > 0 ? leaf_word(units_log2, own - 1) : leaf.word;
    Projection p = project_square(leaf.origin, leaf.side_log2);
    Leaf now = leaf;
    // of a leaf in parts, only those along the edge become finer
    bool is_large = units_log2 > 0 && leaf.side_log2 - own >= SPLIT_FROM;
    if (is_large && !u_budget && !keeps_tolerance(now, edge, p)) return leaf.word | SPLIT;
    while (!keeps_tolerance(now, edge, p)) {
        int step_log2 = step_log2_of(now.word) - 1;
        if (!u_budget) step_log2 = next_step(leaf.origin, leaf.side_log2, ring, step_log2, p);
        if (step_log2 == NO_STEP) return can_split ? leaf.word | SPLIT : leaf.word | IS_BROKEN;
        now.word = leaf_word(units_log2, step_log2);
    }
    return now.word == leaf_word(units_log2, own) ? leaf.word : now.word;
}

void write_square(int id, int units_log2, uint word) {
    int first = plane(u_settled + 1) + id;
    for (int i = 0; i < 1 << 2 * units_log2; i++)
        cell[first + (i >> units_log2) * 8 + (i & (1 << units_log2) - 1)] = word;
}

// A quarter of a leaf that is split: within the tolerance of the whole, or finer.
void write_part(int id, Leaf whole, int part_units_log2, ivec2 low, int ring, Projection p, bool is_new) {
    int side_log2 = whole.side_log2 - 1;
    bool is_on_map = all(lessThan(low, u_last_post)) && all(greaterThan(low + (1 << side_log2), ivec2(0)));
    int step_log2 = min(step_log2_of(whole.word), side_log2);
    if (!u_budget) step_log2 = next_step(low, side_log2, ring, step_log2, p);
    if (step_log2 == NO_STEP) step_log2 = finest_of(low, side_log2, ring, side_log2);
    write_square(id, part_units_log2, is_on_map ? leaf_word(part_units_log2, step_log2) : NOTHING);
    if (is_on_map && is_new) append_leaf(id);
    append_to_queue(u_settled + 1, id, part_units_log2);
}

// The first unit of a leaf's parts; a leaf of a single unit becomes a block. -1: there is no room for another block.
int units_for_parts(Leaf leaf, Block b) {
    if (side_units_log2(leaf.word) > 0) return leaf.id;
    int child = int(atomicAdd(b_all.count, 1u));
    if (child >= u_most_blocks) return -1;  // the view is chosen again with more
    b_block[child] = Block(leaf.origin, b.unit_log2 - 3, b.ring);
    write_square(leaf.id, 0, IS_BLOCK | uint(child));
    append_to_queue(u_settled + 1, leaf.id, 0);
    return UNITS * child;
}

void split(Leaf leaf, Block b) {
    bool in_block = side_units_log2(leaf.word) > 0;
    int part_units_log2 = in_block ? side_units_log2(leaf.word) - 1 : 2, first = units_for_parts(leaf, b);
    if (first < 0) return;
    Projection p = project_square(leaf.origin, leaf.side_log2);
    for (int k = 0; k < 4; k++) {
        ivec2 at = ivec2(k & 1, k >> 1);
        int id = first + (at.y * 8 + at.x << part_units_log2);
        write_part(id, leaf, part_units_log2, leaf.origin + (at << leaf.side_log2 - 1), b.ring, p, k > 0 || !in_block);
    }
}

// Put a leaf and all leaves along its edges into the next round's queue: its change may change their edges.
void queue_around(Leaf leaf) {
    for (int side = 0; side < 4; side++) {
        Edge edge = edge_of(leaf, side);
        append_to_queue(u_settled + 1, edge.leaf.id, side_units_log2(edge.leaf.word));
        while (edge.at[edge.axis] < edge.end) {
            Leaf other = next_along(edge);
            if (is_leaf(other.word)) append_to_queue(u_settled + 1, other.id, side_units_log2(other.word));
        }
    }
}

// A unit that is not a leaf never changes again. The round before wrote it to one plane; copy it to the other.
void keep_square(int id, int units_log2) {
    for (int i = 0; i < 1 << 2 * units_log2; i++) {
        int at = id + (i >> units_log2) * 8 + (i & (1 << units_log2) - 1);
        uint word = cell[plane(u_settled) + at];
        if (!is_leaf(word)) cell[plane(u_settled + 1) + at] = word;
    }
}

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= b_queue[u_settled & 7].count) return;
    uint entry = queued(u_settled, i);
    int id = queued_id(entry);
    uint word = cell[plane(u_settled) + id];
    if (!is_leaf(word)) {
        keep_square(id, queued_units_log2(entry));
        return;
    }
    Block b = b_block[id / UNITS];
    Leaf leaf = leaf_at(b, id, word);
    near_ring = b.ring;
    uint verdict = judge(leaf, b.ring, side_units_log2(word) > 0 || b.unit_log2 >= 3);
    if (verdict != word) {
        queue_around(leaf);
        atomicMax(b_rounds, uint(u_settled) + 1u);
    }
    if ((verdict & SPLIT) != 0u) split(leaf, b);
    else if (verdict != cell[plane(u_settled + 1) + id]) write_square(id, side_units_log2(word), verdict);
}
