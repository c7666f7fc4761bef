// error/bound.glsl — the bound of a whole patch of quads, from summed-area tables, whatever its size.
//   Maximum: "no tile in this rectangle is above class c" is one box count equal to zero (integral histogram, Porikli
//   2005, "Integral histogram: a fast way to extract histograms in Cartesian spaces"); the best c by bisection.
//   Root mean square: the box sum of squared errors over the posts.
// Provides bound_max_m(), bound_rms_m().

#include "error/nodes.glsl"
#include "error/classes.glsl"
#include "sat/box.glsl"

layout(std430, binding = 6) readonly buffer Counters { uint counter[]; };
layout(std430, binding = 7) readonly buffer Squares { uvec2 square[]; };

BOX_SUM(count_sum, uint, counter, sub16)
BOX_SUM(square_sum, uvec2, square, sub64)

ivec2 count_tiles(int level) { return (u_level[level].size + COUNT_TILE - 1) / COUNT_TILE; }

bool none_above(int c, int level, ivec2 low, ivec2 high) {
    Table table = Table(uint(u_level[level].first_count), count_tiles(level));
    uint both = count_sum(table, c >> 1, low, high);
    return ((c & 1) == 0 ? both & 0xffffu : both >> 16) == 0u;
}

// Largest error of `nodes` × `nodes` quads of a level, those from node `at` on; nodes is a power of two from 4 on, and
// `at` a multiple of it.
float bound_max_m(int level, ivec2 at, int nodes) {
    ivec2 low = at / COUNT_TILE, high = (at + nodes) / COUNT_TILE;
    int sure = -1, beyond = CLASSES;
    while (beyond - sure > 1) {
        int c = (sure + beyond) / 2;
        if (none_above(c, level, low, high)) sure = c;
        else beyond = c;
    }
    return sure < 0 ? u_span_m : class_limit_m(sure) * (1.0 + exp2(-18.0));  // exp2() may round anew
}

// Of a square without voids: where posts are fewer than texels, their mean is above the texels'.
float bound_rms_m(int level, ivec2 at, int nodes) {
    Table table = Table(uint(u_level[level].first_count / (CLASSES / 2)), count_tiles(level));
    float sum = word_float(square_sum(table, 0, at / COUNT_TILE, (at + nodes) / COUNT_TILE));
    float side = float(nodes << level);
    return sqrt(sum * exp2(-35.0)) / side * u_span_m * (1.0 + exp2(-20.0));
}
