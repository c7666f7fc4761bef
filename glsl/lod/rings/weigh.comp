// lod/rings/weigh.comp — the error of every square of a block with 1, 2, 4, ... 64 segments a side, in squared pixels, from
// the exact sums of the tables.
//   E(p, T) is the box sum of squared errors; an error of one metre makes w pixels in the middle of the square. A post counts n
//   times, where n is the width of a cell in pixels, or 1 if that is larger: n = max(1, K √(s_x s_y) / z).
//   The mean square of the sag over a cell is about half the square of its largest value.
//   One work group handles one block, one thread one of its units.

#include "lod/rings/squares.glsl"
#include "lod/rings/prices.glsl"

layout(local_size_x = UNITS) in;

uniform bool u_every_post;  // no square is coarser than the posts, and single cells are left out if they are outside the picture

// Two triangles over few posts: a tile of the tables has four such squares, so their own error comes from the posts.
const int FEW_POSTS_LOG2 = 2;

// What is known of a square besides the tables: squared errors with 1 and with 2 segments, and errors of its cells; NEVER if unknown.
struct Known {
    float quad_m2, fan_m2, posts;
    vec2 few_m;  // few_cells_m()
};

Known known_of(ivec2 low, int side_log2) {
    ivec2 own = min(low + (1 << side_log2), u_last_post) - max(low, ivec2(0));
    float posts = float(own.x * own.y), fan_m = rms_of_node_m(low, side_log2, known_m(node_over(low, side_log2), low, side_log2, side_log2 - 1).y);
    float quad_m2 = NEVER;
    if (side_log2 > 0 && has_posts(low, side_log2, FEW_POSTS_LOG2) && coarsest_step(low, side_log2) == side_log2) quad_m2 = quad_squares_m2(side_log2, low >> side_log2);
    return Known(quad_m2, fan_m * fan_m * posts, posts, few_cells_m(low, side_log2));
}

// The tables sum whole tiles, which may reach beyond the box: take the box's share of that sum. It is an upper bound for every T.
float squares_of_box_m2(ivec2 low, int side_log2, int step_log2, Known known) {
    ivec2 end = low + (1 << side_log2), from = max(low, ivec2(0)), to = min(end, u_last_post);
    int tile = max(step_log2, 0) + tile_log2(max(step_log2, 0));
    vec2 asked = vec2((to - 1 >> tile) + 1 - (from >> tile) << tile);
    float few_m = few_parts_m(step_log2, known.few_m).y, sag = sag_m(step_log2);
    float squares = few_m < NEVER ? few_m * few_m * known.posts : squares_m2(low, end, step_log2) * known.posts / (asked.x * asked.y);
    if (step_log2 == side_log2 - 1) squares = min(squares, known.fan_m2);
    if (step_log2 == side_log2 && step_log2 > 0 && known.quad_m2 < NEVER) squares = known.quad_m2;
    return squares + 0.5 * sag * sag * known.posts;
}

// Whether all four parts of a square are drawn.
bool are_drawn(int depth, ivec2 at) {
    int first = square_index(depth + 1, 2 * at), below = first + (2 << depth);
    return ((s_square[first] | s_square[first + 1] | s_square[below] | s_square[below + 1]) & EMPTY) == 0u;
}

void weigh_square(int depth, ivec2 at) {
    int i = square_index(depth, at), first = SIZES_LOG2 * (u_first + i), side_log2 = side_log2_at(depth);
    ivec2 low = low_of(depth, at), end = low + (1 << side_log2);
    Projection p = project_square(low, side_log2);
    bool nothing = is_nothing(low, end) || (p.outside && u_cull != 0), allowed = depth == 3 || fits_finer_ring(low, end);
    if (u_every_post && depth < 3) allowed = are_drawn(depth, at);
    s_square[i] = nothing || !allowed ? EMPTY : WHOLE;
    int coarsest = u_every_post ? 0 : coarsest_step(low, side_log2);
    float px_per_m = u_focal_px * p.stretch / p.middle_m;
    Known known = known_of(low, side_log2);
    for (int k = 0; k < SIZES_LOG2; k++) {
        int step_log2 = side_log2 - k;
        float e = NEVER;
        if (nothing) e = -1.0;
        else if (allowed && step_log2 <= coarsest && step_log2 >= finest_step(side_log2, block.ring)) {
            e = p.outside ? 0.0 : post_weight(p) * px_per_m * px_per_m * squares_of_box_m2(low, side_log2, step_log2, known);
        }
        weight[first + k] = e;
    }
}

void main() {
    int unit = int(gl_LocalInvocationIndex), b = seen_block(gl_WorkGroupID.x);
    take_block(b_block[b]);
    u_first = SQUARES * b;
    for (int depth = 3; depth >= 0; depth--) {
        if (unit < 1 << 2 * depth) weigh_square(depth, square_at(depth, unit));
        barrier();
    }
}
