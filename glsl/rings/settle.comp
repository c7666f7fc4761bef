// rings/settle.comp — a round of neighbours: leaves next to finer ones.
//   A finer neighbour cuts the common edge. Then the strip along it errs by its cells' error and, at most, by what the new
//   vertices add (rings/strip.glsl): where that is not within the tolerance, the leaf itself takes a finer spacing. Where
//   the edge would need more than 64 segments, the leaf is split in four, with the spacings that rings/decide.comp found.
//   All threads look at the leaves as the round before left them, so their order does not matter. Leaves only ever grow
//   finer, so the rounds come to an end.
// A group is a block; its THREADS share the units.

#include "rings/leaf.glsl"
#include "rings/edges.glsl"
#include "rings/strip.glsl"

layout(local_size_x = THREADS) in;
layout(std430, binding = 5) buffer Choices { uint choice[]; };
layout(std430, binding = 4) buffer NewCells { uint new_cell[]; };

uniform int u_round;    // from 1 on
uniform bool u_last;     // of the rounds that are run: what changes now has not settled
uniform bool u_budget;  // nothing is promised: only edges of more than 64 segments matter

const int FIRST[4] = int[4](0, 1, 5, 21);
#define SPLIT 0x10000000u

shared uint s_verdict[UNITS];  // of the unit at a leaf's north-west corner: the leaf's new word
shared uint s_leaves, s_leaf[UNITS];  // such units, side by side: few threads have work, and they are neighbours

Leaf leaf_at(Block b, ivec2 unit, uint word) {
    int units_log2 = side_units_log2(word);
    return Leaf(word, b.origin + (unit >> units_log2 << units_log2 << b.unit_log2), b.unit_log2 + units_log2);
}

bool begins_leaf(ivec2 unit, uint word) { return all(equal(unit & (1 << side_units_log2(word)) - 1, ivec2(0))); }

// Whether a leaf stands its edges. Next to a finer edge OpenGL draws a single segment as a fan around a vertex in the
// middle: of that the tables say nothing, save that in a cell of the map it only helps (|t|/16).
bool stands(Leaf leaf, ivec4 edge_steps_log2, Projection p) {
    int step_log2 = step_log2_of(leaf.word);
    if (step_log2 <= 0) return true;
    if (any(lessThan(edge_steps_log2, ivec4(step_log2))) && leaf.side_log2 == step_log2) return false;
    return u_budget || leaf_px(leaf, edge_steps_log2, p) <= u_tolerance_px;
}

uint judge(Block b, Leaf leaf) {
    int own = step_log2_of(leaf.word), finest = own, units_log2 = side_units_log2(leaf.word);
    near_ring = ring_of(b.root);
    ivec4 edge;
    for (int side = 0; side < 4; side++) finest = min(finest, edge[side] = edge_step_log2(leaf, side));
    if (finest == own) return leaf.word;
    if (leaf.side_log2 - finest > MOST_SEGMENTS_LOG2) return leaf.word | SPLIT;
    Projection p = project_leaf(leaf);
    int step_log2 = own;
    while (!stands(Leaf(leaf_word(units_log2, step_log2), leaf.origin, leaf.side_log2), edge, p)) {
        step_log2 = u_budget ? step_log2 - 1 : next_step(leaf.origin, leaf.side_log2, b.root, step_log2 - 1, p);
        if (step_log2 == NO_STEP) return units_log2 > 0 || b.unit_log2 >= 3 ? leaf.word | SPLIT : leaf.word | IS_BROKEN;
    }
    return step_log2 == own ? leaf.word : leaf_word(units_log2, step_log2);
}

// The spacing of a part of a unit that becomes a block: within the tolerance of the whole unit.
int step_of_part(Leaf unit, int root, ivec2 low, int side_log2, Projection p) {
    int coarsest = min(step_log2_of(unit.word), side_log2);
    int step_log2 = u_budget ? coarsest : next_step(low, side_log2, root, coarsest, p);
    return step_log2 == NO_STEP ? finest_step(side_log2, root) : step_log2;
}

// A unit becomes a block of four leaves.
uint block_of_unit(Leaf unit, int root) {
    int child = int(b_groups[2].w + atomicAdd(b_groups[2].x, 1u));
    if (child >= u_most_blocks) {  // no room: the view is chosen again with more
        atomicMax(b_groups[3].w, uint(child + 1));
        return NOTHING;
    }
    b_child[child - u_root_blocks] = Block(unit.origin, unit.side_log2 - 3, root);
    Projection p = project_leaf(unit);
    for (int depth = 1; depth <= 3; depth++)
        for (int i = 0; i < 1 << 2 * depth; i++) {
            ivec2 at = ivec2(i & (1 << depth) - 1, i >> depth);
            int side_log2 = unit.side_log2 - depth;
            int step_log2 = step_of_part(unit, root, unit.origin + (at << side_log2), side_log2, p);
            choice[SQUARES * child + FIRST[depth] + i] = uint(step_log2 + 16);
        }
    for (int i = 0; i < UNITS; i++) {
        ivec2 at = unit_at(i) >> 2;
        uint word = leaf_word(2, int(choice[SQUARES * child + FIRST[1] + 2 * at.y + at.x]) - 16);
        cell[UNITS * child + i] = new_cell[UNITS * child + i] = word;
    }
    atomicMax(b_groups[3].x, uint(child + 1));
    return IS_BLOCK | uint(child);
}

// What becomes of one of the leaf's units.
uint apply(int b, ivec2 unit, uint word) {
    if ((word & SPLIT) == 0u) return word;
    for (int units_log2 = side_units_log2(word) - 1; units_log2 >= 0; units_log2--) {
        int depth = 3 - units_log2;
        ivec2 at = unit >> units_log2;
        int step_log2 = int(choice[SQUARES * b + FIRST[depth] + (at.y << depth) + at.x]) - 16;
        if (step_log2 != NO_STEP) return leaf_word(units_log2, step_log2);
    }
    if (side_units_log2(word) > 0) return NOTHING;  // beyond the map, or outside the picture
    Block block = block_at(b);
    if (block.unit_log2 < 3) return word & ~SPLIT;  // has no more than 64 segments: FINEST sees to that
    return block_of_unit(Leaf(leaf_word(0, step_log2_of(word)), block.origin + (unit << block.unit_log2), block.unit_log2), block.root);
}

// Marks, after the choices: the last round in which a ring's block changed; and a ring.
int mark_of_root(int root) { return SQUARES * u_most_blocks + root; }
int mark_of_ring(int ring) { return SQUARES * u_most_blocks + u_root_blocks + ring; }
bool is_marked(int i) { return choice[i] == uint(u_round - 1); }

// Whether a block may have new neighbours: something changed in the ring's blocks around, or in the rings next to it.
bool is_active(int root) {
    int r = ring_of(root);
    Ring ring = u_ring[r];
    int k = root - ring.first_block;
    ivec2 at = ivec2(k % ring.patches.x, k / ring.patches.x), low = max(at - 1, 0), high = min(at + 1, ring.patches - 1);
    bool near = (r > 0 && is_marked(mark_of_ring(r - 1))) || (r + 1 < u_rings && is_marked(mark_of_ring(r + 1)));
    for (int y = low.y; y <= high.y; y++)
        for (int x = low.x; x <= high.x; x++)
            near = near || is_marked(mark_of_root(ring.first_block + y * ring.patches.x + x));
    return near;
}

void main() {
    int thread = int(gl_LocalInvocationIndex), b = int(gl_WorkGroupID.x), first = UNITS * b;
    Block block = block_at(b);
    bool idle = u_round > 1 && !is_active(block.root);
    if (thread == 0) s_leaves = 0u;
    barrier();
    for (int unit = thread; unit < UNITS; unit += THREADS) {
        uint word = cell[first + unit];
        if (idle) new_cell[first + unit] = word;
        else if (is_leaf(word) && begins_leaf(unit_at(unit), word)) s_leaf[atomicAdd(s_leaves, 1u)] = uint(unit);
        else if (!is_leaf(word)) new_cell[first + unit] = word;
    }
    barrier();
    if (idle) return;
    for (int i = thread; i < int(s_leaves); i += THREADS) {
        int begin = int(s_leaf[i]);
        s_verdict[begin] = judge(block, leaf_at(block, unit_at(begin), cell[first + begin]));
    }
    barrier();
    for (int unit = thread; unit < UNITS; unit += THREADS) {
        uint word = cell[first + unit];
        if (!is_leaf(word)) continue;
        ivec2 at = unit_at(unit), begin = at >> side_units_log2(word) << side_units_log2(word);
        uint now = apply(b, at, s_verdict[begin.y * 8 + begin.x]);
        if (now != word) {
            choice[mark_of_root(block.root)] = choice[mark_of_ring(ring_of(block.root))] = uint(u_round);
            if (u_last) b_groups[1].y = 2u;  // dispatches are over that would read it
        }
        new_cell[first + unit] = now;
    }
}
