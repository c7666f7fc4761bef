// rings/weigh.comp — the error of every square of a block with 1, 2, 4, ... 64 segments a side, in squared pixels, from
// the exact sums of the tables.
//   E(p, T) is the box sum of squared errors; an error of one metre makes w pixels in the middle of the square. A post counts n
//   times, where n is the width of a cell in pixels, or 1 if that is larger: n = max(1, K √(s_x s_y) / z).
//   The mean square of the sag over a cell is about half the square of its largest value.
//   One work group handles one block, one thread one of its units.

#include "rings/squares.glsl"
#include "rings/prices.glsl"

layout(local_size_x = UNITS) in;

// Two triangles over few posts: a tile of the tables has four such squares, so their own error comes from the posts.
const int FEW_POSTS_LOG2 = 2;

// The tables sum whole tiles, which may reach beyond the box: take the box's share of that sum. It is an upper bound for every T; a fan has a closer one.
float squares_of_box_m2(ivec2 low, int side_log2, int step_log2) {
    ivec2 end = low + (1 << side_log2);
    int tile = max(step_log2, 0) + tile_log2(max(step_log2, 0));
    ivec2 from = max(low, ivec2(0)), to = min(end, u_last_post);
    vec2 own = vec2(to - from), asked = vec2((to - 1 >> tile) + 1 - (from >> tile) << tile);
    float sag = sag_m(step_log2);
    float posts = own.x * own.y, of_fan_m = rms_of_node_m(low, side_log2, known_m(node_over(low, side_log2), low, side_log2, side_log2 - 1).y);
    float few_m = few_parts_m(step_log2, few_cells_m(low, side_log2)).y, of_tables_m2 = squares_m2(low, end, step_log2) * own.x / asked.x * own.y / asked.y;
    float squares = few_m < NEVER ? few_m * few_m * posts : of_tables_m2;
    if (step_log2 == side_log2 - 1) squares = min(squares, of_fan_m * of_fan_m * posts);
    if (step_log2 == side_log2 && step_log2 > 0 && has_posts(low, side_log2, FEW_POSTS_LOG2)) squares = quad_squares_m2(step_log2, low >> step_log2);
    return squares + 0.5 * sag * sag * posts;
}

void weigh_square(int depth, ivec2 at) {
    int i = square_index(depth, at), first = SIZES_LOG2 * (u_first + i), side_log2 = side_log2_at(depth);
    ivec2 low = low_of(depth, at), end = low + (1 << side_log2);
    Projection p = project_square(low, side_log2);
    bool nothing = is_nothing(low, end) || (p.outside && u_cull != 0), allowed = depth == 3 || fits_finer_ring(low, end);
    float px_per_m = u_focal_px * p.stretch / p.middle_m;
    float across = u_focal_px / p.middle_m * sqrt(u_spacing_m.x * u_spacing_m.y);
    for (int k = 0; k < SIZES_LOG2; k++) {
        int step_log2 = side_log2 - k;
        float e = NEVER;
        if (nothing) e = -1.0;
        else if (allowed && step_log2 <= coarsest_step(low, side_log2) && step_log2 >= finest_step(side_log2, block.ring)) {
            float n = step_log2 > 0 ? max(1.0, across) : max(0.0, across - 1.0);
            e = p.outside ? 0.0 : n * px_per_m * px_per_m * squares_of_box_m2(low, side_log2, step_log2);
        }
        weight[first + k] = e;
    }
}

void main() {
    int unit = int(gl_LocalInvocationIndex), b = seen_block(gl_WorkGroupID.x);
    take_block(b_block[b]);
    u_first = SQUARES * b;
    for (int depth = 3; depth >= 0; depth--)
        if (unit < 1 << 2 * depth) weigh_square(depth, square_at(depth, unit));
}
