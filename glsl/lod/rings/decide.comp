// lod/rings/decide.comp — decides into which squares a block is cut, and how many segments each has.
//   For each square, the summed-area tables give the coarsest spacing whose error in this square is within the
//   tolerance. From the units up, four parts are joined wherever the whole square costs no more than the parts:
//       cost(square) = min( 2 T² + PATCH_COST,  sum of its parts' costs )        T segments a side
//   Four parts cost at least 4 (8 + PATCH_COST). If a square costs no more than this, its parts are not tried.
//   One work group handles one block; its THREADS share the squares.   Python twin: reference.rings.cut_block

#include "lod/rings/squares.glsl"

layout(local_size_x = THREADS) in;

uniform int u_round;

// A unit of 2^REFINE_FROM segments or more becomes a block. Refining about halves the cost.
#define REFINE_FROM 3
#define REFINED 0.5
#define LEAST_PARTS (4.0 * (8.0 + PATCH_COST))

shared int s_next[SQUARES];  // squares to try next: an entry is the first of four parts
shared int s_next_count;

// The word of a square (lod/rings/squares.glsl), and its cost as one leaf.
uint try_square(int depth, ivec2 at, out float cost) {
    int side_log2 = side_log2_at(depth);
    ivec2 low = low_of(depth, at);
    ivec2 end = low + (1 << side_log2);
    cost = 0.0;
    if (is_nothing(low, end)) return EMPTY;
    Projection p = project_square(low, side_log2);
    if (p.outside && u_cull != 0) return EMPTY;
    int coarsest = coarsest_step(low, side_log2);
    // The round before found the coarsest spacing for the whole block: its parts try coarser ones only. For the block
    // itself the range is empty, because `finest` is above `coarsest`.
    if (depth == 0 && block.known_log2 != NO_STEP) coarsest = block.known_log2;
    int finest = block.known_log2 != NO_STEP ? block.known_log2 + 1 : finest_of(low, side_log2, block.ring, coarsest);
    int step_log2 = NO_STEP;
    if (depth == 3 || fits_finer_ring(low, end)) {
        step_log2 = next_step(low, side_log2, coarsest, finest, p);
        if (step_log2 == NO_STEP) step_log2 = block.known_log2;
    }
    bool has_step = step_log2 != NO_STEP;
    cost = has_step ? 2.0 * exp2(2.0 * float(side_log2 - step_log2)) + PATCH_COST : HUGE;
    int level;
    bool may_refine = depth == 3 && block.unit_log2 >= 3 && u_round < 2;
    // without a spacing, finer squares help, unless finer posts are still being loaded
    bool refine = may_refine && (has_step ? side_log2 - step_log2 >= REFINE_FROM : !is_waiting(low, side_log2, level));
    if (refine) cost *= REFINED;
    uint state = refine ? REFINE : cost <= LEAST_PARTS || (depth == 3 && has_step) ? WHOLE : OPEN;
    return uint(step_log2 + 16) | state;
}

// Tries one of the four parts of a square: number k after part `first`.
void try_part(int first, int k) {
    int depth = first < FIRST[1] ? 0 : first < FIRST[2] ? 1 : first < FIRST[3] ? 2 : 3;
    int i = first + (k & 1) + (k >> 1 << depth);
    ivec2 at = square_at(depth, i - FIRST[depth]);
    uint square = try_square(depth, at, s_cost[i]);
    s_square[i] = square;
    if (depth == 0 || depth == 3 || (square & OPEN) == 0u) return;
    s_next[atomicAdd(s_next_count, 1)] = square_index(depth + 1, 2 * at);
}

void main() {
    int thread = int(gl_LocalInvocationIndex), b = first_of_round(u_round) + int(gl_WorkGroupID.x);
    if (u_round == 0) b = int(listed[b].seen_block);
    take_block(b_block[b]);
#ifdef PAGED
    block.known_log2 = NO_STEP;  // not known for parts: their pages may differ
#endif
    for (int i = FIRST[2] + thread; i < FIRST[3]; i += THREADS) s_square[i] = 0u;
    s_next[0] = FIRST[1];
    s_next_count = 1;
    barrier();
    int deepest = -1;
    // Square -1 is the whole block. Then each entry of s_next has four. Depths 0 and 1 are tried together, so that more
    // threads have work.
    for (int begin = -1, end = 4; begin < end; deepest++) {
        for (int i = begin + thread; i < end; i += THREADS)
            try_part(i < 0 ? 0 : s_next[i >> 2], max(i, 0) & 3);
        barrier();
        begin = end;
        end = 4 * s_next_count;
        barrier();
    }
    join_all(deepest, thread, THREADS);
    write_units(b, thread, THREADS);
    if (thread == 0 && s_refined > 0u) atomicAdd(b_round[u_round + 1].groups, s_refined);
}
