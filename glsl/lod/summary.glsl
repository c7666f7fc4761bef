// lod/summary.glsl — what the view's mesh comes to, and, where triangles are what is asked for, their price.
//   With a budget a node is drawn as what has the least squared screen error, weighted by lod/price.glsl, + λ · triangles,
//   λ one price for all nodes: no other mesh with as few triangles has less error (Everett 1963, "Generalized Lagrange
//   multiplier method").
//   lod/search.comp looks for the λ that makes the budget's triangles.
// Provides the summary, has_budget().   Python twin: gpu.layout.SUMMARY

#include "blocks/terrain.glsl"

layout(std430, binding = 4) buffer Summary {
    uint s_count[8];     // patches of each size
    uint s_triangles;
    uint s_splits;
    uint s_worst_px;     // float bits: the largest bound among the patches
    float s_price;       // λ, squared pixels a triangle; below 0: a tolerance decides instead
    uvec4 s_groups[MAX_LEVELS];  // dispatch sizes for each level of the tree, of level 0 for the tiles (lod/dispatch.glsl)
    uvec4 s_groups_of_words;     // for all words of the tree, as often as lod/commit.comp looks at them
    vec2 s_cheap;        // log2 of a λ with too many triangles, and log2 of those; x is UNKNOWN at first
    vec2 s_dear;         // the same of one that keeps to the budget
    uint s_budget;       // triangles at most
    uint s_rounds;       // of the search, so far
    int s_side;          // of the budget where the last one ended: 1 within, -1 beyond
    uint s_asked;        // whether leaves asked for anything in the last round of agreeing
};

#define UNKNOWN 1e9

bool has_budget() { return s_price >= 0.0; }
