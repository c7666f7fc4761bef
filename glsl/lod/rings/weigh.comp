// lod/rings/weigh.comp — the error of every square of a block with 1, 2, 4, ... 64 segments a side, in squared
//   pixels, from the exact sums of the tables: n w² E(p, T).
//   E(p, T) is the sum of squared errors over the square p with T segments a side. An error of one metre makes at most
//   w pixels in the middle of the square. n is post_weight().
//   The mean square of the sag over a cell is about half the square of its largest value.
//   One work group handles one block, one thread handles one of its units.   Python twin: reference.post_weights

#include "lod/rings/squares.glsl"
#include "lod/rings/prices.glsl"
#include "error/certified.glsl"

layout(local_size_x = UNITS) in;

// Weight of a post: width in pixels of a cell in the middle of the box, or 1. docs/allocation.md, section 2.
float post_weight(Projection p) { return max(1.0, u_focal_px / p.middle_m * sqrt(u_spacing_m.x * u_spacing_m.y)); }

// The tables sum whole tiles, which may reach beyond the box. So the sum is scaled by the box's share of their posts.
float squares_of_box_m2(ivec2 low, int side_log2, int step_log2, vec2 exact_m) {
    ivec2 end = low + (1 << side_log2);
    ivec2 from = max(low, ivec2(0));
    ivec2 to = min(end, u_last_post);
    float posts = float((to - from).x * (to - from).y);
    float sag = sag_m(step_log2);
    float squares;
    if (step_log2 <= 0 && exact_m.x < HUGE) {
        float rms_m = exact_m.y * exp2(2.0 * float(step_log2));
        squares = rms_m * rms_m * posts;
    } else {
        int tile = max(step_log2, 0) + tile_log2(max(step_log2, 0));
        vec2 asked = vec2((to - 1 >> tile) + 1 - (from >> tile) << tile);
        squares = squares_m2(low, end, step_log2) * posts / (asked.x * asked.y);
    }
    return squares + 0.5 * sag * sag * posts;
}

// With a mean, no patch may be further than FARTHEST tolerances from the truth, as far as finer squares can help.
bool is_near(ivec2 low, int side_log2, int step_log2, bool is_finest, vec2 exact_m, Projection p) {
#ifdef MEAN
    float within_m = error_within_m(p, FARTHEST * u_tolerance_px);
    return is_finest || fits_within(low, side_log2, step_log2, exact_m, p, within_m);
#else
    return true;
#endif
}

void weigh_square(int depth, ivec2 at) {
    int i = square_index(depth, at), first = SIZES * (first_square + i), side_log2 = side_log2_at(depth);
    ivec2 low = low_of(depth, at), end = low + (1 << side_log2);
    Projection p = project_square(low, side_log2);
    bool nothing = is_nothing(low, end) || (p.outside && u_cull != 0);
    bool allowed = depth == 3 || fits_finer_ring(low, end);
    int coarsest = coarsest_step(low, side_log2), finest = finest_step(side_log2, block.ring);
    float px_per_m = u_focal_px * p.stretch / p.middle_m;
    vec2 exact_m = few_cells_m(low, side_log2);
    for (int k = 0; k < SIZES; k++) {
        int step_log2 = side_log2 - k;
        bool has_step = step_log2 <= coarsest && step_log2 >= finest;
        float e = nothing ? -1.0 : HUGE;
        if (!nothing && allowed && has_step
            && is_near(low, side_log2, step_log2, depth == 3 && step_log2 == finest, exact_m, p)) {
            float sum_m2 = p.outside ? 0.0 : squares_of_box_m2(low, side_log2, step_log2, exact_m);
            e = post_weight(p) * px_per_m * px_per_m * sum_m2;
        }
        squares_px2[first + k] = e;
    }
}

void main() {
    int unit = int(gl_LocalInvocationIndex), b = int(listed[gl_WorkGroupID.x].seen_block);
    take_block(b_block[b]);
    first_square = SQUARES * b;
    for (int depth = 3; depth >= 0; depth--)
        if (unit < 1 << 2 * depth) weigh_square(depth, square_at(depth, unit));
}
