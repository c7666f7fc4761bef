// rings/strip.glsl — the strip of cells along an edge that has more segments than the leaf.
//   Every triangle of the strip stays in one cell of the leaf, and its corners are corners of that cell or new vertices on
//   the edge. Move the new vertices onto the straight line between the cell's corners: then the surface is between those
//   of the cell's two diagonals, and its error is at most e, the cell's error. Move the vertices back, each by at most d.
//   No point of the surface moves further than the vertices around it:
//       error ≤ e + d                                                        (docs/guarantee.md, section 4)
//   The tables give e for all cells of the strip. The shader reads the map to find d. Between two posts the true edge is
//   straight, so vertices there do not move.
// Provides strip_of(), is_strip(), edge_move_m(), strip_error_m(), leaf_px().   Python twin: reference.clipmap.strip_error

#include "rings/leaf.glsl"

// The cells of a leaf along one of its sides, as a rectangle: first and last post.
ivec4 strip_of(Leaf leaf, int side) {
    ivec2 low = leaf.origin, end = leaf.origin + (1 << leaf.side_log2);
    int width = 1 << max(step_log2_of(leaf.word), 0);
    int across = 1 - axis_of(side);
    if (is_far(side)) low[across] = end[across] - width;
    else end[across] = low[across] + width;
    return ivec4(low, end);
}

// Whether a strip can have a larger error than its cells.
bool is_strip(ivec4 strip, int step_log2, int edge_step_log2) {
    bool on_map = all(lessThan(strip.xy, u_last_post)) && all(greaterThan(strip.zw, ivec2(0)));
    return on_map && step_log2 > 0 && edge_step_log2 < step_log2;
}

// The largest d between two posts of an edge along an axis, with a vertex every 2^step_log2 posts.
float move_m(ivec2 low, ivec2 high, int axis, int step_log2) {
    float h0 = height_m(low), rise = (height_m(high) - h0) / float(high[axis] - low[axis]), worst_m = 0.0;
    ivec2 post = low;
    for (post[axis] += 1 << step_log2; post[axis] < high[axis]; post[axis] += 1 << step_log2)
        worst_m = max(worst_m, abs(height_m(post) - h0 - rise * float(post[axis] - low[axis])));
    return worst_m * (1.0 + exp2(-18.0)) + u_span_m * exp2(-22.0);
}

// The largest d along a whole side of a leaf.
float edge_move_m(Leaf leaf, int side, int edge_step_log2) {
    int axis = axis_of(side), step_log2 = step_log2_of(leaf.word), length_ = 1 << leaf.side_log2;
    if (step_log2 <= 0) return 0.0;
    ivec2 low = max(leaf.origin, ivec2(0));
    if (is_far(side)) low[1 - axis] = min(leaf.origin[1 - axis] + length_, u_last_post[1 - axis]);
    int end = min(leaf.origin[axis] + length_, u_last_post[axis]);
    float worst_m = 0.0;
    while (low[axis] < end) {
        ivec2 high = low;
        high[axis] = min(low[axis] + (1 << step_log2), u_last_post[axis]);
        worst_m = max(worst_m, move_m(low, high, axis, max(edge_step_log2, 0)));
        low = high;
    }
    return worst_m;
}

float strip_error_m(Leaf leaf, int side, int edge_step_log2) {
    ivec4 strip = strip_of(leaf, side);
    return largest_m(strip.xy, strip.zw, step_log2_of(leaf.word)) + edge_move_m(leaf, side, edge_step_log2);
}

// The error in pixels that the tables certify for a leaf with its edges, in the chosen metric. For the mean, each strip,
// one row of the leaf's cells, adds the square of its largest error, times its share of the leaf.
float leaf_px(Leaf leaf, ivec4 edge_steps_log2, Projection p) {
    if (p.outside) return 0.0;
    int step_log2 = step_log2_of(leaf.word);
    ivec2 end = leaf.origin + (1 << leaf.side_log2);
    float strips_m = 0.0, squares = 0.0, row = exp2(float(step_log2 - leaf.side_log2));
    for (int side = 0; side < 4; side++) {
        ivec4 strip = strip_of(leaf, side);
        if (!is_strip(strip, step_log2, edge_steps_log2[side])) continue;
        float strip_m = strip_error_m(leaf, side, edge_steps_log2[side]);
        strips_m = max(strips_m, strip_m);
        squares += row * strip_m * strip_m;
    }
    float max_m = max(largest_m(leaf.origin, end, step_log2), strips_m);
    if (!has_mean(p)) return error_px(p, max_m, max_m);
    float rms_m = rms_of_box_m(leaf.origin, end, step_log2);
    return error_px(p, sqrt(rms_m * rms_m + squares), max_m);
}
