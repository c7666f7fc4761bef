// lod/quadtree/summary.glsl — the numbers of the view's mesh;
//   with a budget, also the price of a triangle, and the state of the search for it.
//   With a budget, each node is drawn in the way that makes   squared screen error + λ · triangles   smallest.
//   The error is weighted as in lod/quadtree/price.glsl. The price λ is the same for all nodes.
//   Then no mesh with at most as many triangles has a smaller error (Everett 1963, "Generalized Lagrange multiplier
//   method").
//   lod/quadtree/search.comp finds the λ that gives the budget's number of triangles.
// Provides the summary, has_budget().   Python twin: gpu.layout.SUMMARY

#include "blocks/terrain.glsl"

layout(std430, binding = 4) buffer Summary {
    uint s_count[8];     // patches of each size
    uint s_triangles;
    uint s_splits;
    uint s_worst_px;     // float bits: the largest bound among the patches
    float s_price;       // λ in squared pixels for a triangle; below 0 if a tolerance decides
    // Dispatch sizes for each level of the tree; entry 0 is for the tiles (lod/quadtree/dispatch.glsl).
    uvec4 s_groups[MAX_LEVELS];
    uvec4 s_groups_of_words;     // dispatch size of lod/quadtree/commit.comp, for all words of the tree
    vec2 s_lower;        // log2 of a λ with too many triangles, and log2 of their number; x is UNKNOWN at first
    vec2 s_upper;        // the same for a λ within the budget
    uint s_budget;       // the largest number of triangles
    uint s_rounds;       // rounds of the search so far
    int s_side;          // where the last round ended: 1 within the budget, -1 above it
    uint s_asked;        // whether a leaf had a request in the last round of lod/quadtree/agree.comp
};

#define UNKNOWN 1e9

bool has_budget() { return s_price >= 0.0; }
