// lod/rings/prices.glsl — the price λ of a triangle decides. Each patch p takes the T with the least
//       n w² E(p, T) + λ (2 T² + PATCH_COST)          n, w and E as in lod/rings/weigh.comp
//   Everett 1963, "Generalized Lagrange multiplier method": among all meshes of these patches that cost at most as much
//   (the sum of 2 T² + PATCH_COST), this one has the smallest sum of squared errors. A higher price gives fewer
//   triangles. terrain_gl/lod/budget.py searches for the price.
// Provides cheapest().   Python twin: reference.rings.cheapest

#include "lod/rings/leaf.glsl"

// squared pixels of error with 1, 2, 4, ... 64 segments: SIZES numbers for each of a block's SQUARES
layout(std430, binding = 4) buffer SquaresPx2 { float squares_px2[]; };

int first_square;  // the block's first square in squares_px2[]

// The least cost of a square drawn as one leaf, and its triangles. Both are 0 where there is nothing to draw.
vec2 cheapest(int square, int side_log2, float price_, out int segments_log2) {
    vec2 best = vec2(HUGE, 0.0);
    segments_log2 = 0;
    for (int k = 0; k < SIZES; k++) {
        float e = squares_px2[SIZES * square + k];
        float triangles = is_cell_fan(side_log2, side_log2 - k) ? 4.0 : float(2 << 2 * k);
        if (e < 0.0) return vec2(0.0);
        if (price_ * triangles > best.x) break;  // even without an error, more triangles would cost more
        float cost = e >= HUGE ? HUGE : e + price_ * (triangles + PATCH_COST);
        if (cost < best.x) {
            best = vec2(cost, triangles);
            segments_log2 = k;
        }
    }
    return best;
}
