// lod/rings/prices.glsl — the price λ of a triangle at which a mesh fits the budget. For a price, each patch p takes
//   the T with the least   n w² E(p, T) + λ (2 T² + PATCH_COST),   n, w and E as in lod/rings/weigh.comp.
//   Everett 1963, "Generalized Lagrange multiplier method": among all meshes of these patches that cost at most as much
//   (the sum of 2 T² + PATCH_COST), this one has the smallest sum of squared errors. A higher price gives fewer
//   triangles. A pass tries PRICES prices at once: all blocks count the triangles of each. The next pass tries prices
//   between the last one with too many triangles and the first one that fits.
// Provides price(), cheapest().   Python twins: reference.rings.cheapest, reference.rings.bracket

#include "lod/rings/leaf.glsl"

#define PRICES 24
#define PASSES 3
#define SIZES_LOG2 7      // 1, 2, 4, ... 64 segments
#define LOWEST_LOG2 -36.0
#define HIGHEST_LOG2 60.0

// squared pixels of error: SIZES_LOG2 numbers for each of a block's SQUARES
layout(std430, binding = 4) buffer Weights { float weight[]; };
// the price that was found; then the number of triangles at each price that was tried: PRICES numbers for each pass
layout(std430, binding = 7) buffer Tried { float s_found; uint tried[]; };

uniform uint u_target;  // triangles

int u_first;  // the block's first square in weight[]

// log2 of the lowest and the highest price of a pass.
vec2 bracket(int pass_) {
    vec2 ends = vec2(LOWEST_LOG2, HIGHEST_LOG2);
    for (int before = 0; before < pass_; before++) {
        int k = 0;
        while (k < PRICES - 1 && tried[PRICES * before + k] > u_target) k++;
        float step_ = (ends.y - ends.x) / float(PRICES - 1);
        ends = vec2(ends.x + step_ * float(max(k - 1, 0)), ends.x + step_ * float(k));
    }
    return ends;
}

float price_at(int pass_, int k) {
    vec2 ends = bracket(pass_);
    return exp2(mix(ends.x, ends.y, float(k) / float(PRICES - 1)));
}

// The result after pass_ passes: the lowest price tried with at most u_target triangles.
float price(int pass_) { return exp2(bracket(pass_).y); }

// The least cost of a square drawn as one leaf, and its triangles. Both are 0 where there is nothing to draw.
vec2 cheapest(int square, int side_log2, float price_, out int segments_log2) {
    vec2 best = vec2(NEVER, 0.0);
    segments_log2 = 0;
    for (int k = 0; k < SIZES_LOG2; k++) {
        float e = weight[SIZES_LOG2 * square + k];
        float triangles = is_cell_fan(side_log2, side_log2 - k) ? 4.0 : float(2 << 2 * k);
        if (e < 0.0) return vec2(0.0);
        if (price_ * triangles > best.x) break;  // even without an error, more triangles would cost more
        float cost = e >= NEVER ? NEVER : e + price_ * (triangles + PATCH_COST);
        if (cost < best.x) {
            best = vec2(cost, triangles);
            segments_log2 = k;
        }
    }
    return best;
}
