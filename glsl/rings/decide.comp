// rings/decide.comp — into which squares a block is cut, and how finely each is tessellated.
//   Every square of 8, 4, 2 and 1 units asks the summed-area tables for the coarsest spacing that holds its own box within
//   the tolerance; then squares are joined from the units up wherever one is cheaper than its four parts:
//       cost(square) = min( 2 T² + PATCH_COST,  sum of its parts' costs )        T segments a side
//   With a budget of triangles the price λ decides instead (rings/weigh.comp):
//       cost(square) = min over T of ( squared error + λ (2 T² + PATCH_COST) )
//   A group is a block, a thread one of its units.   Python twin: reference.clipmap.cut_block

#include "rings/squares.glsl"
#ifdef BUDGET
#include "rings/prices.glsl"
#endif

layout(local_size_x = UNITS) in;
layout(std430, binding = 5) writeonly buffer Choices { uint choice[]; };  // SQUARES of each block: step_log2 + 16

uniform int u_round;

// Units of that many segments, as a logarithm, are cut up themselves; what they cost then, about.
#define REFINE_FROM 3
#define REFINED 0.5

shared float s_cost[SQUARES];
shared int s_step[SQUARES];
shared bool s_whole[SQUARES];  // drawn in one piece

#ifdef BUDGET

bool can_refine() { return false; }

void decide_square(int depth, ivec2 at) {
    int i = square_index(depth, at), segments_log2;
    vec2 best = cheapest(u_first + i, price(PASSES), segments_log2);
    s_step[i] = best.x >= NEVER ? NO_STEP : side_log2_at(depth) - segments_log2;
    s_cost[i] = best.x;
    s_whole[i] = depth == 3;
    if (best.x == 0.0 && best.y == 0.0) make_nothing(i);
}

#else

bool can_refine() { return block.unit_log2 >= 3 && u_round < 2; }

void decide_square(int depth, ivec2 at) {
    int i = square_index(depth, at), side_log2 = side_log2_at(depth);
    ivec2 low = low_of(depth, at), end = low + (1 << side_log2);
    s_step[i] = NO_STEP;
    s_cost[i] = 0.0;
    s_whole[i] = false;
    if (is_nothing(i)) return;
    Projection p = project_box(low, end, s_range_m[i]);
    if (p.outside && u_cull != 0) {
        make_nothing(i);
        return;
    }
    int coarsest = min(min(side_log2, block.unit_log2), u_top_level);
    if (depth == 3 || !meets_finer_ring(low, end))
        s_step[i] = next_step(low, side_log2, block.root, coarsest, p);
    float segments = exp2(float(side_log2 - s_step[i]));
    s_cost[i] = s_step[i] == NO_STEP ? NEVER : 2.0 * segments * segments + PATCH_COST;
    if (depth == 3 && can_refine() && side_log2 - s_step[i] >= REFINE_FROM) s_cost[i] *= REFINED;
    s_whole[i] = depth == 3;
}

#endif

// A square in one piece, if that is cheaper than in four.
void join_parts(int depth, ivec2 at) {
    int i = square_index(depth, at);
    float parts = 0.0;
    for (int k = 0; k < 4; k++) parts += s_cost[square_index(depth + 1, 2 * at + ivec2(k & 1, k >> 1))];
    s_whole[i] = s_step[i] != NO_STEP && s_cost[i] <= parts;
    if (!s_whole[i]) s_cost[i] = min(parts, 1e20);
}

// The largest square in one piece that holds a unit.
uint word_of_unit(ivec2 at) {
    for (int depth = 0; depth <= 3; depth++) {
        int i = square_index(depth, at >> (3 - depth));
        if (is_nothing(i)) return NOTHING;
        bool refine = depth == 3 && can_refine() && side_log2_at(3) - s_step[i] >= REFINE_FROM;
        if (s_whole[i] && s_step[i] != NO_STEP && !refine) return leaf_word(3 - depth, s_step[i]);
    }
    if (can_refine()) return IS_BLOCK;  // rings/spawn.comp says which
    return leaf_word(0, finest_step(block.unit_log2, block.root)) | IS_BROKEN;
}

void main() {
    int unit = int(gl_LocalInvocationIndex), b = int(b_groups[u_round].w + gl_WorkGroupID.x);
    block = block_at(b);
    ring = ring_of(block.root);
#ifdef BUDGET
    u_first = SQUARES * b;
    for (int i = unit; i < SQUARES; i += UNITS) s_range_m[i] = vec2(0.0);
    barrier();
#else
    gather_ranges(unit);
#endif
    for (int depth = 3; depth >= 0; depth--)
        if (unit < 1 << 2 * depth) decide_square(depth, square_at(depth, unit));
    for (int depth = 2; depth >= 0; depth--) {
        barrier();
        if (unit < 1 << 2 * depth) join_parts(depth, square_at(depth, unit));
    }
    barrier();
    cell[UNITS * b + unit] = word_of_unit(unit_at(unit));
    for (int i = unit; i < SQUARES; i += UNITS) choice[SQUARES * b + i] = uint(s_step[i] + 16);
}
