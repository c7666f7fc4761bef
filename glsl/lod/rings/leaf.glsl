// lod/rings/leaf.glsl — a leaf's box in the view, and the largest error in metres that is within the tolerance there.
// Provides range_of_square_m(), box_of_square(), project_square(), error_within_m(), few_cells_m(),
// coarsest_step(), finest_of(), slack_m(), next_step().
// Python twins: reference.rings.next_step, reference.rings.coarsest_step, reference.rings.finest_step

#include "lod/rings/rings.glsl"
#include "error/bound.glsl"
#include "lod/project.glsl"

#define HUGE 1e30  // stands for infinity
#ifndef PATCH_COST
#define PATCH_COST 14.0  // cost of a patch besides its triangles, counted in triangles
#endif

// Lowest and highest height of a square. It need not be a node: we read the nodes over it, of 2 × 2 cells or more.
vec2 range_of_square_m(ivec2 low, int side_log2) {
    int level = clamp(findLSB(low.x | low.y | 1 << side_log2), 1, u_top_level);
    ivec2 first = max(low, ivec2(0)) >> level, end = (min(low + (1 << side_log2), u_last_post) - 1 >> level) + 1;
    vec2 range_m = vec2(HUGE, -HUGE);
    for (ivec2 at = first; at.y < end.y;) {
        vec2 node_m = unpack_range(range[range_index(level, at)]);
        range_m = vec2(min(range_m.x, node_m.x), max(range_m.y, node_m.y));
        at = at.x + 1 < end.x ? at + ivec2(1, 0) : ivec2(first.x, at.y + 1);
    }
    return range_m;
}

Box box_of_square(ivec2 low, int side_log2) {
    return box_of(max(low, ivec2(0)), min(low + (1 << side_log2), u_last_post), range_of_square_m(low, side_log2));
}

Projection project_square(ivec2 low, int side_log2) { return project(box_of_square(low, side_log2), 1.0); }

// The largest error in metres that is at most the tolerance in pixels: error_px() solved for the error. Half of the
// tolerance is left for it in any case: finer triangles could not make up for rounding.
float error_within_m(Projection p, float px) {
    if (u_metric == METRIC_METRES) return px;
    if (p.outside) return HUGE;
    px = max(px - p.rounding_px, 0.5 * px);
    float per_m = u_focal_px * p.stretch * BOUND_SLACK;
    return px * p.nearest_m / (per_m + px * abs(vertical_w())) * (1.0 - 1e-5);
}

// A tile of level 0 has 4 × 4 cells of the map, and its counters bound all of them. So for a square of at most 2 × 2
// cells, we read the cells themselves.
const int FEW_LOG2 = 1;

// Largest error and root mean square of such a square, each cell drawn as two triangles; HUGE for other squares.
vec2 few_cells_m(ivec2 low, int side_log2) {
    if (side_log2 > FEW_LOG2 || loaded_level(low, low + (1 << side_log2), 0) > 0) return vec2(HUGE);
    ivec2 first = max(low, ivec2(0));
    ivec2 end = min(low + (1 << side_log2), u_last_post);
    ivec2 cells = max(end - first, ivec2(0));
    vec2 found = vec2(0.0);  // largest twist, sum of squares
    for (int i = 0; i < cells.x * cells.y; i++) {
        ivec2 at = first + ivec2(i % cells.x, i / cells.x);
        float t = is_hole(at) ? 0.0 : twist_m(at);
        found = vec2(max(found.x, abs(t)), found.y + t * t);
    }
    return vec2(0.25 * found.x, 0.125 * sqrt(found.y / float(cells.x * cells.y))) * (1.0 + exp2(-18.0));
}

// A unit that is 1 post wide can have neighbours that cannot be split: up to 2 posts wide if the unit is in ring 0, and
// 4 posts wide in other rings. An edge has at most 64 segments: along a side of 4 posts that is 16 between two posts.
int finest_step(int side_log2, int ring) {
    return max(side_log2 - MOST_SEGMENTS_LOG2, u_ring[ring].level == 0 ? FINEST : FINEST + 1);
}

// The coarsest spacing of a square. A side has two segments or more, so that each cell of this spacing has a corner
// inside the square. The square's corner is on the lattice of the spacing, so these cells are nodes of the tables.
int coarsest_step(ivec2 low, int side_log2) {
    return min(min(findLSB(low.x | low.y | 1 << side_log2), u_top_level), side_log2 - 1);
}

// Whether posts of the square's finest mesh are not loaded yet; `level` is the finest level that is wholly loaded.
bool is_waiting(ivec2 low, int side_log2, out int level) {
    int finest = max(side_log2 - MOST_SEGMENTS_LOG2, 0);
    level = loaded_level(low, low + (1 << side_log2), finest);
    return level > finest;
}

// The finest spacing that can reduce the error. Where finer posts are not loaded, it is the spacing of loaded posts.
int finest_of(ivec2 low, int side_log2, int ring, int coarsest) {
    int level, finest = finest_step(side_log2, ring);
    return is_waiting(low, side_log2, level) ? max(finest, min(level, coarsest)) : finest;
}

// Errors that the tables do not include: the Earth's curvature, and the rounding of vertices between posts.
float slack_m(int step_log2) { return sag_m(step_log2) + rounding_between_m(); }

// Whether the cells of a square are within the tolerance.
bool fits_within(ivec2 low, int side_log2, int step_log2, vec2 exact_m, Projection p, float within_m) {
    p.sag_m = slack_m(step_log2);
    float allowed_m = within_m - p.sag_m;
    if (allowed_m < 0.0) return false;
    if (step_log2 <= 0 && exact_m.x < HUGE) return exact_m.x * exp2(2.0 * float(step_log2)) <= allowed_m;
    return is_within_m(low, low + (1 << side_log2), step_log2, allowed_m);
}

// The coarsest spacing, from `coarsest` to `finest`, that the tables allow; NO_STEP if there is none.
int next_step(ivec2 low, int side_log2, int coarsest, int finest, Projection p) {
    float within_m = error_within_m(p, u_tolerance_px);
    vec2 exact_m = few_cells_m(low, side_log2);
    for (int step_log2 = coarsest; step_log2 >= finest; step_log2--)
        if (fits_within(low, side_log2, step_log2, exact_m, p, within_m)) return step_log2;
    return NO_STEP;
}
