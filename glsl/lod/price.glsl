// lod/price.glsl — whether triangles are worth their price λ (lod/summary.glsl) where a node stands in the picture.
//   An error of δ metres makes w δ pixels there: a gain of g m² a triangle is one of w² g px².
//   w is the bound over the node's box (lod/project.glsl): for nodes small beside their distance, and almost all are, close
//   to what it is everywhere in them; large ones it splits a little early, where they hardly ever remain leaves.
//   A picture shows near land in many pixels a post, far land with many posts a pixel: a post counts once, and near the eye
//   as often as it is pixels across when seen from straight above it,
//       n = max(1, K/z √(s_x s_y)),   s the spacing, z the depth.
// Provides pays(), quad_pays().   Python twin of n: reference.post_weights

#include "lod/tree.glsl"
#include "lod/summary.glsl"

float post_weight(Projection p) {
    return max(1.0, u_focal_px / p.middle_m * sqrt(u_spacing_m.x * u_spacing_m.y));
}

bool pays(Projection p, float gain_m2) {
    float w = u_focal_px * p.stretch / p.nearest_m;
    return post_weight(p) * w * w * gain_m2 > s_price;
}

// Whether a leaf is better drawn as a quad than as a fan of so many triangles.
bool quad_pays(Projection p, PackedNode n, int level, ivec2 at, float fan_triangles) {
    vec2 squares = squares_m2(n, level, at);
    return fan_triangles <= 2.0 || !pays(p, (squares.x - squares.y) / (fan_triangles - 2.0));
}
