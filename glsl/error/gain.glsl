// error/gain.glsl — what a triangle buys where a node is split: squared error taken away per triangle added, m².
//   A leaf is a quad, 2 triangles and squared error Q, or a fan, 4 triangles and F; its parts are quads of squared error P
//   with R triangles in all. At a price of λ a triangle a node costs squared error + λ · triangles, so that
//       the fan is cheaper than the quad   below   λ = (Q − F) / (4 − 2),
//       the parts than the quad            below   λ = (Q − P) / (R − 2),
//       the parts than the fan             below   λ = (F − P) / (R − 4),
//   and the parts are cheapest below the least of what applies: that is the node's own gain.
//   (Pruning by price: Breiman, Friedman, Olshen, Stone 1984, "Classification and regression trees", chapter 3; Chou,
//   Lookabaugh, Gray 1989, "Optimal pruning with applications to tree-structured source coding and modeling".)
//   Gains are nested, never below those of the node's children: where a child is worth its price the way to it is, too.
// Provides gain[], split_gain().   Python twin: reference.split_gains

layout(std430, binding = 3) buffer Gains { float gain[]; };

float split_gain(float quad, float fan, float fan_triangles, float parts, float parts_triangles) {
    float for_quad = (quad - parts) / max(parts_triangles - 2.0, 1.0);
    float fan_pays = (quad - fan) / max(fan_triangles - 2.0, 1.0);
    if (for_quad >= fan_pays || parts_triangles <= fan_triangles) return max(for_quad, 0.0);
    return max((fan - parts) / (parts_triangles - fan_triangles), 0.0);
}
