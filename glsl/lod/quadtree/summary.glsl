// lod/quadtree/summary.glsl — the numbers of the view's mesh; with a budget, also the price of a triangle.
//   With a budget, each node is drawn in the way that makes   squared screen error + λ · triangles   smallest.
//   The error is weighted as in lod/quadtree/price.glsl. The price λ is the same for all nodes.
//   No other mesh with at most as many triangles as this mesh has a smaller squared error (Everett 1963, "Generalized
//   Lagrange multiplier method").
//   terrain_gl/lod/quadtree.py searches for the λ that gives the budget's number of triangles.
// Provides the summary, has_budget().   Python twin: gpu.layout.SUMMARY

#include "blocks/terrain.glsl"

layout(std430, binding = 4) buffer Summary {
    uint s_count[8];     // patches of each size
    uint s_triangles;
    uint s_splits;
    uint s_worst_px;     // float bits: the largest bound among the patches
    float s_price;       // λ in squared pixels for a triangle; below 0 if a tolerance decides
    uint s_asked;        // whether a leaf had a request in the last round of lod/quadtree/agree.comp
    uint s_offset[];     // patches of each size in each tile; lod/place.glsl replaces each by the sum before it
};

bool has_budget() { return s_price >= 0.0; }
