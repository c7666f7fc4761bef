// lod/quadtree/refine.comp — split every node of a level that is in the picture and over tolerance however it is drawn;
//   with a budget, every node whose children are worth their triangles. One dispatch for each level, root first.
//   One thread decides the 32 nodes of one word.
// Python twin: reference.select

#include "lod/quadtree/price.glsl"

layout(local_size_x = GROUP) in;
layout(std430, binding = 5) readonly buffer Gains { float gain[]; };

uniform int u_which_level;

// A wider margin: a node that is outside here is outside, too, when patches are made of its children.
bool must_split(ivec2 at) {
    Projection p = project_node(u_which_level, at, 2.0);
    if (p.outside) return false;
    if (has_budget()) return split_pays(p, gain[node_index(u_which_level, at)], u_which_level, at);
    if (u_tolerance_px == 0.0) return true;
    PackedNode n = node_of(u_which_level, at);
    // RMS: the fan alone decides. Its stored error is never below the errors of the node's children
    // (error/nodes.glsl). So if a neighbour makes this node split, its children are within the tolerance, too.
    // Maximum: see agree.comp
    float least_px = u_metric == METRIC_RMS ? best_fan_px(p, n) : min(best_fan_px(p, n), quad_px(p, n));
    return least_px > u_tolerance_px * STRICTER;
}

void main() {
    int row = int(gl_GlobalInvocationID.y), word = int(gl_GlobalInvocationID.x);
    if (word >= words_in_row(u_which_level)) return;
    uint bits = 0u;
    for (uint left = existing_word(u_which_level, word, row); left != 0u; left &= left - 1u) {
        int bit = findLSB(left);
        if (must_split(ivec2(32 * word + bit, row))) bits |= 1u << bit;
    }
    int i = word_index(u_which_level, word, row);
    split[i] = bits;
    split[CUT_WEST * tree_words() + i] = split[CUT_NORTH * tree_words() + i] = 0u;
}
