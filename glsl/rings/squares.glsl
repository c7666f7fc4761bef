// rings/squares.glsl — the squares of a block, and which of them become leaves.
//   Depth d has 2^d × 2^d squares of 8 >> d units a side. One work group handles one block. First each square gets a cost of
//   its own. Then, from the units up, four parts are joined wherever the whole square costs no more than they do. Of parts that
//   remain, two with the same spacing become a pair.
// Provides block, root_block(), square_index(), low_of(), is_nothing(), fits_finer_ring(), join_all(), word_of_unit(), write_unit().
// Python twin: reference.clipmap.cut_block

#include "rings/leaf.glsl"
#include "rings/lists.glsl"

const int FIRST[4] = int[4](0, 1, 5, 21);  // squares of each depth: 8, 4, 2, 1 units a side

// A square's word: log2 of the spacing of its vertices, + 16, and one of these states. WHOLE: it is drawn as one leaf. OPEN: its
// parts decide. REFINE: a unit that becomes a block. WIDE, TALL: one of a pair.
#define EMPTY 0x100u
#define WHOLE 0x200u
#define OPEN 0x400u
#define REFINE 0x800u
#define WIDE 0x1000u
#define TALL 0x2000u
#ifndef PAIR_GAIN
#define PAIR_GAIN PATCH_COST  // a pair is one patch, two squares are two
#endif
shared uint s_square[SQUARES];
shared float s_cost[SQUARES];

Block block;

int square_index(int depth, ivec2 at) { return FIRST[depth] + (at.y << depth) + at.x; }
int side_log2_at(int depth) { return block.unit_log2 + 3 - depth; }
ivec2 low_of(int depth, ivec2 at) { return block.origin + (at << side_log2_at(depth)); }
ivec2 square_at(int depth, int i) { return ivec2(i & (1 << depth) - 1, i >> depth); }

// Block number b of the rings, which are numbered ring after ring.
Block root_block(int b) {
    int r = 0;
    while (r + 1 < u_rings && b >= u_ring[r + 1].first_block) r++;
    Ring ring = u_ring[r];
    ivec2 at = ivec2((b - ring.first_block) % ring.patches.x, (b - ring.first_block) / ring.patches.x);
    return Block(ring.origin + at * (PATCH << ring.level), ring.level, r);
}

bool has_finer_ring() { return block.ring > 0; }

// Whether a square lies beyond the map, or where the finer ring is drawn.
bool is_nothing(ivec2 low, ivec2 end) {
    if (any(greaterThanEqual(low, u_last_post)) || any(lessThanEqual(end, ivec2(0)))) return true;
    if (!has_finer_ring()) return false;
    Ring finer = u_ring[block.ring - 1];
    return all(greaterThanEqual(low, finer.origin)) && all(lessThanEqual(end, ring_end(finer)));
}

// Whether a square may be one leaf beside the finer ring. Of two leaves that meet, one must have the whole common edge. So a
// square that touches the finer ring must stand on the lattice of that ring's squares; if not, its parts make no pairs.
bool fits_finer_ring(ivec2 low, ivec2 end) {
    if (!has_finer_ring()) return true;
    Ring finer = u_ring[block.ring - 1];
    ivec2 finer_end = ring_end(finer), side = min(end - low, ivec2(PATCH << finer.level));
    if (any(greaterThan(low, finer_end)) || any(lessThan(end, finer.origin))) return true;
    bool overlaps = all(lessThan(low, finer_end)) && all(greaterThan(end, finer.origin));
    return !overlaps && all(equal(low - finer.origin & side - 1, ivec2(0)));
}

// Whether two squares side by side become one leaf, a pair: they have the same spacing. Single cells do not: the tessellator would
// add a vertex between them.
bool is_pairing(int depth, ivec2 first, ivec2 second) {
    uint a = s_square[square_index(depth, first)], b = s_square[square_index(depth, second)];
    int segments_log2 = side_log2_at(depth) - (int(a & 63u) - 16);
    return (a & b & WHOLE) != 0u && ((a ^ b) & 63u) == 0u && segments_log2 > 0 && segments_log2 < MOST_SEGMENTS_LOG2;
}

// How many pairs along an axis the four parts of a square make; their words get the flag.
int pair_along(int depth, ivec2 at, ivec2 axis, uint flag) {
    int pairs = 0;
    for (int k = 0; k < 2; k++) {
        ivec2 first = 2 * at + k * axis.yx, second = first + axis;
        if (!is_pairing(depth, first, second)) continue;
        pairs++;
        s_square[square_index(depth, first)] |= flag;
        s_square[square_index(depth, second)] |= flag;
    }
    return pairs;
}

void join_parts(int depth, ivec2 at) {
    int i = square_index(depth, at);
    if ((s_square[i] & OPEN) == 0u) return;
    float parts = 0.0;
    for (int k = 0; k < 4; k++) parts += s_cost[square_index(depth + 1, 2 * at + ivec2(k & 1, k >> 1))];
    bool may_pair = fits_finer_ring(low_of(depth, at), low_of(depth, at) + (1 << side_log2_at(depth)));
    int wide = may_pair ? pair_along(depth + 1, at, ivec2(1, 0), 0u) : 0;
    int tall = may_pair ? pair_along(depth + 1, at, ivec2(0, 1), 0u) : 0;
    parts -= PAIR_GAIN * float(max(wide, tall));
    if (s_cost[i] <= parts && s_cost[i] < NEVER) {
        s_square[i] |= WHOLE;
        return;
    }
    if (tall > wide) pair_along(depth + 1, at, ivec2(0, 1), TALL);
    else if (wide > 0) pair_along(depth + 1, at, ivec2(1, 0), WIDE);
    s_cost[i] = min(parts, 1e20);
}

void join_all(int thread, int threads) {
    for (int depth = 2; depth >= 0; depth--) {
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
        if ((square & REFINE) != 0u) return IS_BLOCK;  // rings/spawn.comp adds the block's number
        uint pair = (square & WIDE) != 0u ? IS_WIDE : (square & TALL) != 0u ? IS_TALL : 0u;
        if ((square & WHOLE) != 0u) return leaf_word(3 - depth, int(square & 63u) - 16) | pair;
    }
    return leaf_word(0, finest_of(low_of(3, at), block.unit_log2, block.ring, block.unit_log2)) | IS_BROKEN;
}

// Returns the unit's word.
uint write_unit(int b, int unit) {
    uint word = word_of_unit(unit_at(unit));
    int id = UNITS * b + unit;
    cell[plane(0) + id] = cell[plane(1) + id] = word;
    if (is_leaf(word) && begins_leaf(unit_at(unit), word)) {
        append_leaf(id);
        append_to_queue(0, id, word);
    }
    return word;
}
