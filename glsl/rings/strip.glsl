// rings/strip.glsl — the strip of cells along an edge that is cut more finely than the leaf.
//   Every triangle of the strip stays in one cell of the leaf, and its corners are corners of that cell or new vertices of
//   the edge. Move the new vertices down to the straight line between the cell's corners: what is drawn then lies between
//   the cell's two diagonals, and errs by at most e, the cell's error. That line is a side of either diagonal's triangles,
//   so a new vertex has moved by at most e, too. Moved back, it takes no place further with it:
//       error ≤ 2 e                                                          (docs/guarantee.md, section 4)
//   Between two posts the truth is straight, so vertices there do not move.
// Provides strip_of(), is_strip(), strip_error_m(), leaf_px().   Python twin: reference.clipmap.strip_error

#include "rings/leaf.glsl"

// The cells of a leaf along one of its sides: post where they begin, post where they end.
ivec4 strip_of(Leaf leaf, int side) {
    ivec2 low = leaf.origin, end = leaf.origin + (1 << leaf.side_log2);
    int width = 1 << max(step_log2_of(leaf.word), 0);
    if (side == 0) end.x = low.x + width;
    if (side == 1) end.y = low.y + width;
    if (side == 2) low.x = end.x - width;
    if (side == 3) low.y = end.y - width;
    return ivec4(low, end);
}

// Whether a strip errs by more than its cells do.
bool is_strip(ivec4 strip, int step_log2, int edge_step_log2) {
    bool on_map = all(lessThan(strip.xy, u_last_post)) && all(greaterThan(strip.zw, ivec2(0)));
    return on_map && step_log2 > 0 && edge_step_log2 < step_log2;
}

float strip_error_m(ivec4 strip, int step_log2) { return 2.0 * largest_m(strip.xy, strip.zw, step_log2); }

// What the tables certify of a leaf with its edges, in pixels, in the metric asked for. A strip is one row of cells of the
// leaf: it adds that share of its largest square to the mean of all.
float leaf_px(Leaf leaf, ivec4 edge_steps_log2, Projection p) {
    if (p.outside) return 0.0;
    int step_log2 = step_log2_of(leaf.word);
    ivec2 end = leaf.origin + (1 << leaf.side_log2);
    float strips_m = 0.0, squares = 0.0, row = exp2(float(step_log2 - leaf.side_log2));
    for (int side = 0; side < 4; side++) {
        ivec4 strip = strip_of(leaf, side);
        if (!is_strip(strip, step_log2, edge_steps_log2[side])) continue;
        float strip_m = strip_error_m(strip, step_log2);
        strips_m = max(strips_m, strip_m);
        squares += row * strip_m * strip_m;
    }
    float max_m = max(largest_m(leaf.origin, end, step_log2), strips_m);
    if (!has_mean(p)) return error_px(p, max_m, max_m);
    float rms_m = rms_of_box_m(leaf.origin, end, step_log2);
    return error_px(p, sqrt(rms_m * rms_m + squares), max_m);
}
