// error/first.comp — level 1 of the error table: all posts of a node, nine at most, are vertices. So each height is read once, and
// the errors at each post are computed once, for the post and for up to four cells.
// Python twins: reference.node_errors, reference.wedge_errors

#include "error/record.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

const ivec2 CELLS[4] = ivec2[4](ivec2(0, 0), ivec2(1, 1), ivec2(0, 1), ivec2(1, 0));  // on the falling diagonal, then on the rising one

// Only the post in the middle of an edge can move it.
CutEdges middles_m(Node n) {
    vec4 from = vec4(n.h[0][0], n.h[0][0], n.h[0][2], n.h[2][0]), to = vec4(n.h[2][0], n.h[0][2], n.h[2][2], n.h[2][2]);
    vec4 above = vec4(n.h[1][0], n.h[0][1], n.h[1][2], n.h[2][1]) - from - (to - from) * n.per_side.yxyx;
    return CutEdges(raised(n, max(above, 0.0)), raised(n, max(-above, 0.0)));
}

vec2 range_of_posts(Node n) {
    vec3 low = min(min(n.h[0], n.h[1]), n.h[2]), high = max(max(n.h[0], n.h[1]), n.h[2]);
    return vec2(min(min(low.x, low.y), low.z), max(max(high.x, high.y), high.z)) + n.base_m;
}

void main() {
    if (any(greaterThanEqual(ivec2(gl_GlobalInvocationID.xy), u_count))) return;
    ivec2 at = u_first + ivec2(gl_GlobalInvocationID.xy);
    Node n = node_at(u_which_level, at);
    CutEdges c = middles_m(n);
    Worst w = worst_of_nothing();
    PostErrors e[9];
    for (int i = 0; i < 9; i++) {
        ivec2 place = ivec2(i % 3, i / 3), post = min(n.low + place, u_last_post);
        e[i] = errors_at(n, c, post, n.vertex_m[place.y][place.x]);
        if (is_void(post)) w.voids = 1u;
        else gather_post(w, n, e[i], all(lessThan(n.low + place, own_end(n))));
    }
    vec2 kink = is_square(n) ? vec2(0.0) : kinks_m(n);
    vec4 twists = vec4(0.0);
    for (int k = 0; k < 4; k++) {
        ivec2 place = CELLS[k], cell = n.low + place;
        int i = 3 * place.y + place.x;
        bool is_cell = all(lessThan(cell, n.high)) && !is_hole(cell), falling = k < 2;
        if (is_cell && falling) twists[k] = gather_cell(w, n, e[i], e[i + 4], e[i + 1], e[i + 3], kink);
        if (is_cell && !falling) twists[k] = gather_cell(w, n, e[i + 3], e[i + 1], e[i + 4], e[i], kink);
    }
    vec4 squares = twists * twists / 90.0;  // a cell, as two triangles, has errors only between its posts
    settle_node(at, n, w, Parts(squares.x + squares.w + squares.z + squares.y, 0.0, pack_range(range_of_posts(n)), 0u, 0u));
}
