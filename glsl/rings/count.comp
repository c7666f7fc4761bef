// rings/count.comp — each leaf's shape with its edges, the number of patches of each size, and the largest bound.
// One thread handles one leaf.

#include "rings/leaf.glsl"
#include "rings/lists.glsl"
#include "rings/edges.glsl"
#include "rings/strip.glsl"
#include "rings/shapes.glsl"

layout(local_size_x = LEAF_GROUP) in;

// Segments of a leaf along an axis that are on the map, for a spacing.
int segments_on_map(int from, int last, int side_log2, int step_log2) {
    int posts = clamp(last - from, 0, 1 << side_log2) - max(0, -from);
    return step_log2 >= 0 ? posts + (1 << step_log2) - 1 >> step_log2 : posts << -step_log2;
}

// Triangles with an area: every cell has two, and each additional segment of an edge makes one more.
int triangles_of(Leaf leaf, int step_log2, ivec4 edge_steps_log2) {
    int x = segments_on_map(leaf.origin.x, u_last_post.x, leaf.side_log2, step_log2);
    int y = segments_on_map(leaf.origin.y, u_last_post.y, leaf.side_log2, step_log2), triangles = 2 * x * y;
    for (int side = 0; side < 4; side++) {
        int axis = side == WEST || side == EAST ? 1 : 0;
        int edge = segments_on_map(leaf.origin[axis], u_last_post[axis], leaf.side_log2, edge_steps_log2[side]);
        triangles += edge - (axis == 1 ? y : x);
    }
    bool fan = leaf.side_log2 == step_log2 && any(lessThan(edge_steps_log2, ivec4(step_log2)));
    return fan ? triangles + 2 : triangles;
}

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= b_leaves.count) return;
    int id = int(list[i]);
    uint word = cell[plane(u_settled) + id];
    if (!is_leaf(word)) return;
    Block b = b_block[id / UNITS];
    Leaf leaf = leaf_at(b, id, word);
    near_ring = b.ring;
    int step_log2 = step_log2_of(word);
    ivec4 steps;
    for (int side = 0; side < 4; side++) steps[side] = edge_step_log2(leaf, side);
    uint px = floatBitsToUint(leaf_px(leaf, steps, project_square(leaf.origin, leaf.side_log2)));
    shape[id] = uvec2(shape_word(leaf.side_log2, step_log2, min(leaf.side_log2 - steps, MOST_SEGMENTS_LOG2)), px);
    atomicAdd(s_offset[(leaf.side_log2 - step_log2) * u_most_blocks + id / UNITS], 1u);
    atomicAdd(s_count[leaf.side_log2 - step_log2], 1u);
    atomicAdd(s_triangles, uint(triangles_of(leaf, step_log2, steps)));
    atomicAdd(s_splits, side_units_log2(word) < 3 ? 1u : 0u);
    atomicMax(s_worst_px, px);
}
