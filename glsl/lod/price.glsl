// lod/price.glsl — whether triangles are worth their price λ (lod/summary.glsl) where a node stands in the picture.
//   An error of δ metres makes w δ pixels there: a gain of g m² a triangle is one of w² g px².
//   w is the bound over the node's box (lod/project.glsl): for nodes small beside their distance, and almost all are, close
//   to what it is everywhere in them; large ones it splits a little early, where they hardly ever remain leaves.
//   A picture shows near land in many pixels a post, far land with many posts a pixel: a post counts once, and near the eye
//   as often as it is pixels across when seen from straight above it,
//       n = max(1, K/z √(s_x s_y)),   s the spacing, z the middle's depth.
//   Of these n the post itself is one; the others lie between it and the next, on the bilinear surface through the posts.
//   A cell with corners a, b, c, d and the twist t = a − b − c + d strays from that, in the mean of the squares, by
//       t² / 90     as a quad, whichever diagonal it is cut along,
//       t² / 1440   as a fan around its middle, (a + b + c + d) / 4;
//   so that two triangles more take away (n − 1) t² (1/90 − 1/1440) / 2 = (n − 1) t² / 192 each.
// Provides pays(), quad_pays(), cell_fan_pays().   Python twins: reference.post_weights (n), reference.cell_squares (t²)

#include "error/node_errors.glsl"
#include "lod/tree.glsl"
#include "lod/summary.glsl"

float pixels_across(Projection p) { return u_focal_px / p.middle_m * sqrt(u_spacing_m.x * u_spacing_m.y); }

float post_weight(Projection p) { return max(1.0, pixels_across(p)); }

bool pays(Projection p, float gain_m2) {
    float w = u_focal_px * p.stretch / p.nearest_m;
    return post_weight(p) * w * w * gain_m2 > s_price;
}

// Whether a leaf is better drawn as a quad than as a fan of so many triangles.
bool quad_pays(Projection p, PackedNode n, int level, ivec2 at, float fan_triangles) {
    vec2 squares = squares_m2(n, level, at);
    return fan_triangles <= 2.0 || !pays(p, (squares.x - squares.y) / (fan_triangles - 2.0));
}

// Whether a cell is better drawn as a fan of four triangles than as a quad of two.
bool cell_fan_pays(Projection p, ivec2 cell) {
    float between = pixels_across(p) - 1.0;
    if (!has_budget() || p.outside || between <= 0.0 || is_hole(cell)) return false;
    float t_m = twist_m(cell), w = u_focal_px * p.stretch / p.nearest_m;
    return between * w * w * t_m * t_m / 192.0 > s_price;
}
