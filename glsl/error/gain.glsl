// error/gain.glsl — the gain of splitting a node: the squared error that each added triangle removes, in m².
//   A leaf is a quad with 2 triangles and squared error Q, or a fan with 4 triangles and squared error F. Its children
//   are quads with squared error P and R triangles together. With the price λ of a triangle, a node costs
//   squared error + λ · triangles. So
//       the fan costs less than the quad       if λ < (Q − F) / (4 − 2),
//       the children cost less than the quad   if λ < (Q − P) / (R − 2),
//       the children cost less than the fan    if λ < (F − P) / (R − 4).
//   The children cost least if λ is below the smaller of the bounds that apply: this is the node's gain.
//   (Pruning by price: Breiman, Friedman, Olshen, Stone 1984, "Classification and regression trees", chapter 3; Chou,
//   Lookabaugh, Gray 1989, "Optimal pruning with applications to tree-structured source coding and modeling".)
//   A gain is never below the gains of the node's children. So if a child is split, all nodes above it are split, too.
// Provides gain[], split_gain().   Python twin: reference.split_gains

layout(std430, binding = 3) buffer Gains { float gain[]; };

float split_gain(float quad, float fan, float fan_triangles, float parts, float parts_triangles) {
    float for_quad = (quad - parts) / max(parts_triangles - 2.0, 1.0);
    float fan_pays = (quad - fan) / max(fan_triangles - 2.0, 1.0);
    if (for_quad >= fan_pays || parts_triangles <= fan_triangles) return max(for_quad, 0.0);
    return max((fan - parts) / (parts_triangles - fan_triangles), 0.0);
}
