// error/certified.glsl — what the tables certify of the cells in any rectangle: the largest error, and the sum of
//   squared errors, which is a box of a table, in four fetches.
//   Sums are exact if they fit into 64 bits. Only edits far beyond the quantisation range can make larger ones.
// Provides largest_m(), squares_m2().   Python twins: reference.bound_max_m, reference.square_table, reference.box_sum

#include "error/bound.glsl"
#include "sat/bits.glsl"

// The smallest bound of all cells of spacing 2^step_log2 in a rectangle of posts.
float largest_m(ivec2 low, ivec2 end, int step_log2) {
    int level = max(step_log2, 0);
#ifdef PAGED
    bool is_mixed;
    int loaded = resident_level(low, end, level, is_mixed);
    if (loaded > level) return largest_of_coarse_m(low, end, level, loaded, is_mixed);
#endif
    float error_m = largest_of_level_m(low, end, level);
    return step_log2 < 0 ? error_m * exp2(2.0 * float(step_log2)) : error_m;
}

layout(std430, binding = 3) readonly buffer Squares { uvec2 square[]; };

#define SQUARE(i) square[i]
BOX_SUM(square_sum, uvec2, SQUARE, sub64)

float most_squares_m2(ivec2 low, ivec2 end) {
    vec2 posts = vec2(min(end, u_last_post) - max(low, ivec2(0)) + 1) * most_m();
    return posts.x * posts.y;
}

bool may_overflow(ivec2 low, ivec2 end) {
    return most_m() > u_span_m && most_squares_m2(low, end) > u_span_m * u_span_m * exp2(24.0);
}

// Of cells of spacing 2^step_log2 in a rectangle of posts.
// No return comes before the fetches: zink of Mesa 22.3 crashes then.
float squares_m2(ivec2 low, ivec2 end, int step_log2) {
#ifndef PAGED
    Table table;
    ivec4 tiles = tiles_over(low, end, max(step_log2, 0), table);
    table.first /= uint(CLASSES / 4);
    uvec2 total = square_sum(table, 0, tiles.xy, tiles.zw);
#else
    bool is_mixed;
    int from = max(step_log2, 0), level = resident_level(low, end, from, is_mixed);
    if (level > from) {
        vec2 cells = vec2(min(end, u_last_post) - max(low, ivec2(0)));
        float worst_m = largest_of_coarse_m(low, end, from, level, is_mixed);
        return worst_m * worst_m * cells.x * cells.y;
    }
    ivec4 nodes = nodes_over(low, end, level);
    uvec2 total = uvec2(0u);
    for (int y = nodes.y >> PAGE_LOG2; y <= nodes.w >> PAGE_LOG2; y++)
        for (int x = nodes.x >> PAGE_LOG2; x <= nodes.z >> PAGE_LOG2; x++) {
            Table table = counts_of_page(slot_of(level, ivec2(x, y)), level);
            table.first /= uint(CLASSES / 4);
            ivec4 tiles = tiles_in_page(nodes, ivec2(x, y), level);
            total = add64(total, square_sum(table, 0, tiles.xy, tiles.zw));
        }
#endif
    float sum = word_float(total) * exp2(-35.0) * u_span_m * u_span_m;
    sum = step_log2 < 0 ? sum * exp2(4.0 * float(step_log2)) : sum;
    return may_overflow(low, end) ? most_squares_m2(low, end) : sum;
}
