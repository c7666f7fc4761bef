// lod/rings/count.comp — computes each leaf's bound, and whether the leaf is hidden. Counts the patches that are not
//   hidden by size, and finds their largest bound. With MEAN, the tolerance is of a mean over the picture. One thread
//   handles one leaf.

#include "lod/rings/hidden.glsl"
#include "lod/rings/shapes.glsl"
#include "lod/rings/mean.glsl"

layout(local_size_x = LEAF_GROUP) in;

// Number of segments along a side of a leaf that are on the map, for a spacing.
int edge_segments(Leaf leaf, int side, int step_log2) {
    int axis = axis_of(side), from = leaf.origin[axis];
    int posts = clamp(u_last_post[axis] - from, 0, 1 << leaf.side_log2) - max(0, -from);
    return step_log2 >= 0 ? posts + (1 << step_log2) - 1 >> step_log2 : posts << -step_log2;
}

// Triangles with an area: every cell has two, and each additional segment of an edge makes one more.
int triangles_of(Leaf leaf, int step_log2, ivec4 edge_steps_log2) {
    ivec2 cells = ivec2(edge_segments(leaf, NORTH, step_log2), edge_segments(leaf, WEST, step_log2));
    int triangles = 2 * cells.x * cells.y;
    for (int side = 0; side < 4; side++)
        triangles += edge_segments(leaf, side, edge_steps_log2[side]) - cells[axis_of(side)];
    return triangles;
}

// The bounds that the tables certify for a leaf's largest error, and for its root mean square: in pixels, or in metres
// if the mesh is for the whole map.
vec2 leaf_px(Leaf leaf, Projection p) {
    int step_log2 = step_log2_of(leaf.word);
    p.sag_m = slack_m(step_log2);
    vec2 errors_m = cells_m(leaf.origin, leaf.side_log2, step_log2, few_cells_m(leaf.origin, leaf.side_log2));
    if (u_metric == METRIC_METRES) return vec2(errors_m.x + p.sag_m);
    if (p.outside) return vec2(0.0);
    return vec2(error_px(p, errors_m.x, errors_m.x), error_px(p, min(errors_m.y, errors_m.x), errors_m.x));
}

#ifdef MEAN
// A patch adds 2^44 at most. A mesh that fits has fewer cells, so a mesh with such a patch never fits.
uvec2 words_of(float x) {
    float value = min(x, exp2(44.0)), high = floor(value * exp2(-32.0));
    return uvec2(uint(value - high * exp2(32.0)), uint(high));
}

void add_to_mean(Leaf leaf, float mean_px, bool is_land) {
    vec2 cells = vec2(min(leaf.origin + (1 << leaf.side_log2), u_last_post) - max(leaf.origin, ivec2(0)));
    float n = cells.x * cells.y, of_tolerance = mean_px / u_tolerance_px;
    ATOMIC_ADD_64(mesh_squares, words_of(ceil(64.0 * n * of_tolerance * of_tolerance * (1.0 + exp2(-18.0)))));
    float at_most = n < exp2(24.0) ? n : floor(n * (1.0 - exp2(-18.0)));  // a float may be rounded up
    if (is_land) ATOMIC_ADD_64(mesh_land, words_of(at_most));
}
#endif

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= b_leaves.count) return;
    int id = int(listed[i].leaf);
    uint word = unit_word[plane(u_agreed) + id];
    if (!is_leaf(word)) return;
    Block b = b_block[id / UNITS];
    Leaf leaf = leaf_at(b, id, word);
    int step_log2 = step_log2_of(word);
    int segments_log2 = leaf.side_log2 - step_log2;
    ivec4 steps = leaf.side_log2 - edges_log2_in(shape[id].x);
    Projection p = project_square(leaf.origin, leaf.side_log2);
    bool hidden = is_hidden(box_of_square(leaf.origin, leaf.side_log2));
    vec2 px = leaf_px(leaf, p);
    float shown_px = px.x;
#ifdef MEAN
    bool is_land = has_mean(p, leaf.origin, leaf.side_log2, step_log2);
    if (is_land) shown_px = px.y;
    if (!hidden) add_to_mean(leaf, px.y, is_land);
#endif
    shape[id].y = floatBitsToUint(shown_px) | (hidden ? HIDDEN : 0u);
    if (hidden) {
        atomicAdd(mesh_hidden, 1u);
        return;
    }
    atomicAdd(mesh_offset[segments_log2 * u_most_blocks + id / UNITS], 1u);
    atomicAdd(mesh_count[segments_log2], 1u);
    atomicAdd(mesh_triangles, uint(triangles_of(leaf, step_log2, steps)));
    atomicAdd(mesh_splits, side_units_log2(word) < 3 ? 1u : 0u);
    atomicMax(mesh_worst_px, floatBitsToUint(px.x));
}
