// rings/strip.glsl — the strip of cells along an edge that is cut more finely than the leaf.
//   Every triangle of the strip stays in one cell of the leaf, and its corners are corners of that cell or new vertices of
//   the edge. Move the new vertices down to the straight line between the cell's corners: what is drawn then lies between
//   the cell's two diagonals, and errs by at most e, the cell's error. Moving them back by d at most changes a place at
//   the share w of the way from the edge to the other side by (1 − w) d at most:
//       error ≤ e + (1 − w) d                                                (docs/guarantee.md, section 4)
//   In a cell with two such edges a triangle may reach from one to the other: there w counts as 0.
//   d is read off the map itself. Between two posts the truth is straight, so vertices there move by nothing.
//   Small cells are looked at place by place; for large ones the tables give e of the whole strip.
// Provides strip_error_m(), leaf_px().   Python twin: reference.clipmap.strip_error

#include "rings/leaf.glsl"
#include "error/node_errors.glsl"

#define LOOK_CLOSER 2  // up to cells of 2^2 posts

// The largest d between two posts of an edge that runs along an axis, with a vertex every 2^step_log2 posts.
float move_m(ivec2 low, ivec2 high, int axis, int step_log2) {
    float h0 = height_m(low), rise = (height_m(high) - h0) / float(high[axis] - low[axis]), worst_m = 0.0;
    ivec2 post = low;
    for (post[axis] += 1 << step_log2; post[axis] < high[axis]; post[axis] += 1 << step_log2)
        worst_m = max(worst_m, abs(height_m(post) - h0 - rise * float(post[axis] - low[axis])));
    return worst_m * (1.0 + exp2(-18.0)) + u_span_m * exp2(-22.0);
}

// d of one cell's side, 0 where the edge is no finer.
float cell_move_m(Node n, int side, int edge_step_log2, int step_log2) {
    if (edge_step_log2 >= step_log2) return 0.0;
    ivec2 low = n.low, high = n.high;
    int axis = side == 0 || side == 2 ? 1 : 0;
    low[1 - axis] = high[1 - axis] = side >= 2 ? n.high[1 - axis] : n.low[1 - axis];
    return move_m(low, high, axis, max(edge_step_log2, 0));
}

// The error of one cell of a leaf at spacing 2^step_log2 ≥ 2, some of its sides cut more finely.
float cut_cell_error_m(ivec2 at, int step_log2, ivec4 edge_steps_log2, bvec4 on_edge) {
    Node n = node_at(step_log2, at);
    if (!is_square(n)) return u_span_m;
    float move = 0.0, error = 0.0;
    int sides = 0, cut = 0;
    for (int side = 0; side < 4; side++) if (on_edge[side] && edge_steps_log2[side] < step_log2) {
        move = max(move, cell_move_m(n, side, edge_steps_log2[side], step_log2));
        cut = side;
        sides++;
    }
    float per_side = 1.0 / float(n.high.x - n.low.x);
    for (int y = n.low.y; y < n.high.y; y++)
        for (int x = n.low.x; x < n.high.x; x++) {
            ivec2 cell = ivec2(x, y), d = cell - n.low, far = n.high - cell;
            bool solid = false;  // a hole's solid posts count, too
            float e = 0.0;
            for (int i = 0; i < 4; i++) {
                ivec2 post = cell + ivec2(i & 1, i >> 1);
                if (is_void(post)) continue;
                e = max(e, quad_error_m(n, post, height_m(post) - n.base_m));
                solid = true;
            }
            if (!solid) continue;
            bool crossed = d.x == d.y || d.x + d.y == n.high.x - n.low.x - 1;
            if (crossed && !is_hole(cell)) e += 0.25 * abs(twist_m(cell));
            int near = cut == 0 ? d.x : cut == 1 ? d.y : cut == 2 ? far.x - 1 : far.y - 1;
            error = max(error, e + (sides == 1 ? 1.0 - float(near) * per_side : 1.0) * move);
        }
    return error * (1.0 + exp2(-18.0)) + n.rounding_m;
}

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

bool is_on_map(ivec4 strip) {
    return all(lessThan(strip.xy, u_last_post)) && all(greaterThan(strip.zw, ivec2(0)));
}

// The largest d along a whole side of a leaf.
float edge_move_m(Leaf leaf, int side, int edge_step_log2) {
    int axis = side == 0 || side == 2 ? 1 : 0, step_log2 = step_log2_of(leaf.word), length_ = 1 << leaf.side_log2;
    if (step_log2 <= 0) return 0.0;
    ivec2 low = max(leaf.origin, ivec2(0));
    if (side >= 2) low[1 - axis] = min(leaf.origin[1 - axis] + length_, u_last_post[1 - axis]);
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

// The largest error of a strip of small cells, looked at one by one.
float close_strip_error_m(Leaf leaf, int side, ivec4 edge_steps_log2) {
    ivec4 strip = strip_of(leaf, side);
    int step_log2 = step_log2_of(leaf.word);
    ivec2 first = max(strip.xy, ivec2(0)) >> step_log2, end = (min(strip.zw, u_last_post) - 1 >> step_log2) + 1;
    ivec2 leaf_first = leaf.origin >> step_log2, leaf_last = leaf_first + (1 << leaf.side_log2 - step_log2) - 1;
    float worst_m = 0.0;
    for (int y = first.y; y < end.y; y++)
        for (int x = first.x; x < end.x; x++) {
            bvec4 on_edge = bvec4(x == leaf_first.x, y == leaf_first.y, x == leaf_last.x, y == leaf_last.y);
            worst_m = max(worst_m, cut_cell_error_m(ivec2(x, y), step_log2, edge_steps_log2, on_edge));
        }
    return worst_m;
}

float strip_error_m(Leaf leaf, int side, ivec4 edge_steps_log2) {
    ivec4 strip = strip_of(leaf, side);
    int step_log2 = step_log2_of(leaf.word);
    if (!is_on_map(strip) || step_log2 <= 0) return 0.0;
    if (step_log2 <= LOOK_CLOSER) return close_strip_error_m(leaf, side, edge_steps_log2);
    return largest_m(strip.xy, strip.zw, step_log2) + edge_move_m(leaf, side, edge_steps_log2[side]);
}

// What the tables certify of a leaf with its edges, in pixels, in the metric asked for. A strip is one row of cells of the
// leaf: it adds that share of its largest square to the mean of all.
float leaf_px(Leaf leaf, ivec4 edge_steps_log2, Projection p) {
    if (p.outside) return 0.0;
    int step_log2 = step_log2_of(leaf.word);
    ivec2 end = leaf.origin + (1 << leaf.side_log2);
    float strips_m = 0.0, squares = 0.0, row = exp2(float(step_log2 - leaf.side_log2));
    for (int side = 0; side < 4; side++) if (edge_steps_log2[side] < step_log2) {
        float strip_m = strip_error_m(leaf, side, edge_steps_log2);
        strips_m = max(strips_m, strip_m);
        squares += row * strip_m * strip_m;
    }
    if (has_mean(p)) {
        float rms_m = rms_of_box_m(leaf.origin, end, step_log2);
        return error_px(p, sqrt(rms_m * rms_m + squares), max(largest_m(leaf.origin, end, step_log2), strips_m));
    }
    float max_m = max(largest_m(leaf.origin, end, step_log2), strips_m);
    return error_px(p, max_m, max_m);
}
