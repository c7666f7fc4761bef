// rings/count.comp — each leaf's shape, with its edges; how many patches there are of each size; the largest bound.
// A group is a block; its THREADS share the units.

#include "rings/leaf.glsl"
#include "rings/edges.glsl"
#include "rings/strip.glsl"
#include "rings/shapes.glsl"

layout(local_size_x = THREADS) in;

shared uint s_patches[SIZES];
shared uint s_leaves, s_leaf[UNITS];  // units at leaves' corners, side by side

// Segments of a leaf along an axis that are on the map, at a spacing.
int segments_on_map(int from, int last, int side_log2, int step_log2) {
    int posts = clamp(last - from, 0, 1 << side_log2) - max(0, -from);
    return step_log2 >= 0 ? posts + (1 << step_log2) - 1 >> step_log2 : posts << -step_log2;
}

// Those with an area: every cell has two, and each cut of an edge makes one more.
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

void count_leaf(int i, Leaf leaf) {
    int step_log2 = step_log2_of(leaf.word);
    ivec4 steps;
    for (int side = 0; side < 4; side++) steps[side] = edge_step_log2(leaf, side);
    float px = leaf_px(leaf, steps, project_leaf(leaf));
    shape[i] = uvec2(shape_word(leaf.side_log2, step_log2, min(leaf.side_log2 - steps, MOST_SEGMENTS_LOG2)),
                     floatBitsToUint(px));
    atomicAdd(s_patches[leaf.side_log2 - step_log2], 1u);
    atomicAdd(s_triangles, uint(triangles_of(leaf, step_log2, steps)));
    atomicAdd(s_splits, side_units_log2(leaf.word) < 3 ? 1u : 0u);
    atomicMax(s_worst_px, floatBitsToUint(px));
}

void main() {
    int thread = int(gl_LocalInvocationIndex), b = int(gl_WorkGroupID.x), first = UNITS * b;
    if (b >= min(blocks_in_all(), u_most_blocks)) return;
    for (int size = thread; size < SIZES; size += THREADS) s_patches[size] = 0u;
    if (thread == 0) s_leaves = 0u;
    barrier();
    for (int unit = thread; unit < UNITS; unit += THREADS) {
        uint word = cell[first + unit];
        shape[first + unit] = uvec2(0u);
        if (is_leaf(word) && (unit_at(unit) & (1 << side_units_log2(word)) - 1) == ivec2(0)) s_leaf[atomicAdd(s_leaves, 1u)] = uint(unit);
    }
    memoryBarrierBuffer();
    barrier();
    Block block = block_at(b);
    near_ring = ring_of(block.root);
    for (int i = thread; i < int(s_leaves); i += THREADS) {
        int begin = int(s_leaf[i]);
        uint word = cell[first + begin];
        ivec2 origin = block.origin + (unit_at(begin) << block.unit_log2);
        count_leaf(first + begin, Leaf(word, origin, block.unit_log2 + side_units_log2(word)));
    }
    barrier();
    for (int size = thread; size < SIZES; size += THREADS) {
        s_offset[size * u_most_blocks + b] = s_patches[size];
        atomicAdd(s_count[size], s_patches[size]);
    }
}
