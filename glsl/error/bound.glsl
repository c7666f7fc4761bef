// error/bound.glsl — the bound of any rectangle of cells, from summed-area tables, in four fetches.
//   A class c has a limit, class_limit_m(c). Its table counts the tiles whose largest error is above the limit. If the
//   count over the rectangle is zero, all errors there are within the limit (integral histogram, Porikli 2005,
//   "Integral histogram: a fast way to extract histograms in Cartesian spaces").
//   A tile has 2^tile_log2() nodes a side. A rectangle is widened to whole tiles. Counters of 8 bits are exact for up
//   to 255 tiles. A larger rectangle is looked up in parts of 15 × 15 tiles.
//   For a spacing 2^j below 1, a cell of the map is cut into n × n parts, n = 2^-j. The error of a part is |t|/(4 n²),
//   where t is the twist of the cell. So the table of level 0 is used with n² times the tolerance.
// Provides is_within_m(), largest_of_level_m(), range[].   Python twins: reference.bound_max_m, reference.class_tables

#include "blocks/terrain.glsl"
#include "sat/box.glsl"

layout(std430, binding = 2) readonly buffer Counters { uint counter[]; };  // of four classes in each word
layout(std430, binding = 6) readonly buffer Ranges { uint range[]; };  // of heights, a word for each node

#define COUNTER(i) counter[i]

// Four differences of 8 bits: sub_apart() of sat/word.glsl.
uint sub8(uint a, uint b) { return ((a | 0x80808080u) - (b & 0x7f7f7f7fu)) ^ ((a ^ ~b) & 0x80808080u); }

BOX_SUM(count_sum, uint, COUNTER, sub8)

// The tiles of a level over a rectangle of posts: first column and row, then the column and row after the last.
ivec4 tiles_over(ivec2 low, ivec2 end, int level, out Table counts) {
    int side_log2 = level + tile_log2(level);
    counts = Table(uint(u_level[level].first_count), (u_last_post - 1 >> side_log2) + 1);
    return ivec4(max(low, ivec2(0)) >> side_log2, (min(end, u_last_post) - 1 >> side_log2) + 1);
}

#define NO_CLASS -1   // even the last limit is above the error
#define ALL_WITHIN -2  // no error of the map is larger

// The class of the largest limit that is not above an error, or one of these two. log2 may round up: step on then.
int class_within(float error_m) {
    if (error_m >= most_m()) return ALL_WITHIN;
    int c = max(0, int(ceil(class_of_octave(log2(u_span_m / error_m)))));
    if (class_limit_m(c) * (1.0 + exp2(-18.0)) > error_m) c++;
    return c < CLASSES ? c : NO_CLASS;
}

// Large rectangles are looked up in parts, row by row, in one loop: software renderers run two nested ones slowly.
ivec2 next_part(ivec2 at, ivec4 tiles) { return at.x + 15 < tiles.z ? at + ivec2(15, 0) : ivec2(tiles.x, at.y + 15); }

bool none_above(Table counts, ivec4 tiles, int c) {
    for (ivec2 at = tiles.xy; at.y < tiles.w; at = next_part(at, tiles)) {
        uint four = count_sum(counts, c >> 2, at, min(at + 15, tiles.zw));
        if ((four >> 8 * (c & 3) & 255u) != 0u) return false;
    }
    return true;
}

bool none_above_over(ivec2 low, ivec2 end, int level, int c);  // below; of a store, in pages/bound.glsl

// The smallest bound of a level over a rectangle of posts: the limit of a class, or the largest error of all.
float largest_of_level_m(ivec2 low, ivec2 end, int level) {
    int sure = -1, beyond = CLASSES;  // nothing is above class `sure`; something is above class `beyond`
    while (beyond - sure > 1) {
        int c = (sure + beyond) / 2;
        if (none_above_over(low, end, level, c)) sure = c;
        else beyond = c;
    }
    // exp2() may round differently here and in error/count.comp, which counted
    return sure < 0 ? most_m() : class_limit_m(sure) * (1.0 + exp2(-18.0));
}

#ifdef PAGED
#include "pages/bound.glsl"
#else
// Whether no error of a level over a rectangle of posts is above a class.
bool none_above_over(ivec2 low, ivec2 end, int level, int c) {
    Table counts;
    ivec4 tiles = tiles_over(low, end, level, counts);
    return none_above(counts, tiles, c);
}
#endif

// Whether the error of every cell of spacing 2^step_log2 in a rectangle of posts is at most error_m.
bool is_within_m(ivec2 low, ivec2 end, int step_log2, float error_m) {
    int level = max(step_log2, 0);
#ifdef PAGED
    bool is_mixed;
    int loaded = resident_level(low, end, level, is_mixed);
    if (loaded > level) return largest_of_coarse_m(low, end, level, loaded, is_mixed) <= error_m;
#endif
    int c = class_within(step_log2 < 0 ? error_m * exp2(-2.0 * float(step_log2)) : error_m);
    return c < 0 ? c == ALL_WITHIN : none_above_over(low, end, level, c);
}
