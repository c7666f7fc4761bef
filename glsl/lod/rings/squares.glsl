// lod/rings/squares.glsl — the squares of a block, and which of them become leaves.
//   Depth d has 2^d × 2^d squares of 8 >> d units a side. One work group handles one block. First each square gets a
//   cost of its own. Then, from the units up, four parts are joined wherever the whole square costs no more than
//   the four parts.
// Provides block, take_block(), low_of(), is_nothing(), fits_finer_ring(), join_all(), word_of_unit(), write_units().
// Python twin: reference.rings.cut_block

#include "lod/rings/leaf.glsl"

const int FIRST[4] = int[4](0, 1, 5, 21);  // squares of each depth: 8, 4, 2, 1 units a side

// A square's word: log2 of the spacing of its vertices, + 16, and a state. EMPTY: nothing to draw. WHOLE: one leaf.
// OPEN: cut into its parts, unless join_all() makes it WHOLE. REFINE: a unit that becomes a block.
#define EMPTY 0x100u
#define WHOLE 0x200u
#define OPEN 0x400u
#define REFINE 0x800u
shared uint s_square[SQUARES];
shared float s_cost[SQUARES];

Block block;
Ring finer_ring;  // of the block; without meaning in the finest ring

void take_block(Block b) {
    block = b;
    finer_ring = u_ring[max(b.ring - 1, 0)];
}

int square_index(int depth, ivec2 at) { return FIRST[depth] + (at.y << depth) + at.x; }
int side_log2_at(int depth) { return block.unit_log2 + 3 - depth; }
ivec2 low_of(int depth, ivec2 at) { return block.origin + (at << side_log2_at(depth)); }
ivec2 square_at(int depth, int i) { return ivec2(i & (1 << depth) - 1, i >> depth); }

// Whether a square lies beyond the map, or where the finer ring is drawn.
bool is_nothing(ivec2 low, ivec2 end) {
    if (any(greaterThanEqual(low, u_last_post)) || any(lessThanEqual(end, ivec2(0)))) return true;
    if (block.ring == 0) return false;
    return all(greaterThanEqual(low, finer_ring.origin)) && all(lessThanEqual(end, ring_end(finer_ring)));
}

// Whether a square may be one leaf beside the finer ring. The common edge of two leaves must be a whole side of one of
// them. So a square that touches the finer ring must lie on the lattice of that ring's squares.
bool fits_finer_ring(ivec2 low, ivec2 end) {
    if (block.ring == 0) return true;
    ivec2 finer = finer_ring.origin;
    ivec2 finer_end = ring_end(finer_ring);
    ivec2 side = min(end - low, ivec2(BLOCK_SIDE << finer_ring.level));
    if (any(greaterThan(low, finer_end)) || any(lessThan(end, finer))) return true;
    bool overlaps = all(lessThan(low, finer_end)) && all(greaterThan(end, finer));
    return !overlaps && all(equal(low - finer & side - 1, ivec2(0)));
}

void join_parts(int depth, ivec2 at) {
    int i = square_index(depth, at);
    if ((s_square[i] & OPEN) == 0u) return;
    int first = square_index(depth + 1, 2 * at);
    int below = first + (2 << depth);
    float parts = s_cost[first] + s_cost[first + 1] + s_cost[below] + s_cost[below + 1];
    bool is_whole = s_cost[i] <= parts && s_cost[i] < HUGE;
    if (is_whole) s_square[i] |= WHOLE;
    else s_cost[i] = parts;
}

// Joins squares from the given depth up; no deeper square has parts.
void join_all(int deepest, int thread, int threads) {
    for (int depth = deepest; depth >= 0; depth--) {
        barrier();
        for (int k = thread; k < 1 << 2 * depth; k += threads) join_parts(depth, square_at(depth, k));
    }
    barrier();
}

// The word of a unit: that of the largest WHOLE square which contains it.
uint word_of_unit(ivec2 at) {
    for (int depth = 0; depth <= 3; depth++) {
        uint square = s_square[square_index(depth, at >> (3 - depth))];
        if ((square & EMPTY) != 0u) return NOTHING;
        if ((square & REFINE) != 0u) return IS_BLOCK | square & 63u;  // lod/rings/spawn.comp puts in the block's number
        if ((square & WHOLE) != 0u) return leaf_word(3 - depth, int(square & 63u) - 16);
    }
    return leaf_word(0, finest_of(low_of(3, at), block.unit_log2, block.ring, block.unit_log2 - 1)) | IS_BROKEN;
}

shared uint s_leaf[UNITS];      // units where the block's leaves begin
shared uint s_leaves, s_first;  // number of these leaves; place of the first in the list of all leaves
shared uint s_refined;          // units that become blocks

// Writes the words of a block's units after join_all(), and appends its leaves to the list.
void write_units(int b, int thread, int threads) {
    if (thread == 0) s_leaves = s_refined = 0u;
    barrier();
    for (int unit = thread; unit < UNITS; unit += threads) {
        uint word = word_of_unit(unit_at(unit));
        unit_word[plane(0) + UNITS * b + unit] = unit_word[plane(1) + UNITS * b + unit] = word;
        if (is_leaf(word) && begins_leaf(unit_at(unit), word)) s_leaf[atomicAdd(s_leaves, 1u)] = uint(unit);
        if ((word & IS_BLOCK) != 0u) atomicAdd(s_refined, 1u);
    }
    barrier();
    if (thread == 0) s_first = append_leaves(s_leaves);
    barrier();
    for (uint i = uint(thread); i < s_leaves; i += uint(threads)) {
        listed[s_first + i].leaf = uint(UNITS * b) + s_leaf[i];
    }
}
