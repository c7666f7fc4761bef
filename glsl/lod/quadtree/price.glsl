// lod/quadtree/price.glsl — whether triangles of a node are worth their price λ (lod/quadtree/summary.glsl).
//   An error of δ metres is at most w δ pixels anywhere in the node's box (lod/project.glsl). So a gain of g m² for a
//   triangle is w² g px². Large nodes are split a little early, but they are hardly ever leaves.
//   A post has the weight n (post_weight() of lod/project.glsl): 1 for the post itself, and n − 1 for the places around
//   it, where the truth is bilinear.
//   A cell with corners a, b, c, d and the twist t = a − b − c + d has the mean squared error
//       t² / 90     as a quad, with either diagonal,
//       t² / 1440   as a fan around its centre, (a + b + c + d) / 4.
//   So each of the fan's two additional triangles removes (n − 1) t² (1/90 − 1/1440) / 2 = (n − 1) t² / 192.
//   The mean square of a node's sag is about half the square of its largest value G. A split divides the sag by four,
//   and adds six triangles. So each of them removes about p (1 - 1/16) G² / 12, p the number of the node's posts.
// Provides pays(), split_pays(), quad_pays(), cell_fan_pays().   Python twin: reference.cell_squares (t²)

#include "error/node_errors.glsl"
#include "lod/quadtree/tree.glsl"
#include "lod/quadtree/summary.glsl"

bool pays(Projection p, float gain_m2) {
    float w = u_focal_px * p.stretch / p.nearest_m;
    return post_weight(p) * w * w * gain_m2 > s_price;
}

bool split_pays(Projection p, float gain_m2, int level, ivec2 at) {
    return pays(p, gain_m2 + own_posts(level, at) * p.sag_m * p.sag_m * (15.0 / 192.0));
}

// Whether a quad costs less than a fan with this number of triangles.
bool quad_pays(Projection p, PackedNode n, int level, ivec2 at, float fan_triangles) {
    vec2 squares = squares_m2(n, level, at);
    return fan_triangles <= 2.0 || !pays(p, (squares.x - squares.y) / (fan_triangles - 2.0));
}

// Whether, for a cell, a fan of four triangles costs less than a quad of two.
bool cell_fan_pays(Projection p, ivec2 cell) {
    float between = pixels_across(p) - 1.0;
    if (!has_budget() || p.outside || between <= 0.0 || is_hole(cell)) return false;
    float t_m = twist_m(cell), w = u_focal_px * p.stretch / p.nearest_m;
    return between * w * w * t_m * t_m / 192.0 > s_price;
}
