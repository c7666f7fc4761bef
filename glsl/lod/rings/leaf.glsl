// lod/rings/leaf.glsl — a leaf's box in the view, and the largest error in metres that is within the tolerance there.
// Provides range_of_square_m(), project_square(), error_within_m(), has_mean(), few_cells_m(), cells_m(), rms_of_box_m(), coarsest_step(), slack_m(), node_over(), known_m(), next_step(), next_step_or_known(), leaf_px().
// Python twins: reference.rings.next_step, reference.rings.coarsest_step, reference.rings.finest_step

#include "lod/rings/rings.glsl"
#include "error/bound.glsl"
#include "error/node_errors.glsl"
#include "lod/project.glsl"
#include "error/nodes.glsl"

layout(std430, binding = 6) readonly buffer Ranges { NodeRange range[]; };

#define NEVER 1e30
#ifndef PATCH_COST
#define PATCH_COST 28.0  // cost of a patch besides its triangles, counted in triangles
#endif

#ifdef PAGED
// The index of a node's range. If its page is not loaded: that of the nearest node above it whose page is loaded.
int range_index(int level, ivec2 at) {
    int slot = slot_of(level, at >> PAGE_LOG2);
    while (slot < 0) slot = slot_of(++level, (at >>= 1) >> PAGE_LOG2);
    ivec2 in_page = at & PAGE - 1;
    return (slot * PAGE + in_page.y) * PAGE + in_page.x;
}
#else
int range_index(int level, ivec2 at) { return node_index(level, at); }
#endif

// Lowest and highest height of a square at any place: the square consists of nodes, as large as possible.
vec2 range_of_square_m(ivec2 low, int side_log2) {
    int level = clamp(findLSB(low.x | low.y | 1 << side_log2), 1, u_top_level);
    ivec2 first = max(low, ivec2(0)) >> level, end = (min(low + (1 << side_log2), u_last_post) - 1 >> level) + 1;
    vec2 range_m = vec2(NEVER, -NEVER);
    for (ivec2 at = first; at.y < end.y;) {
        vec2 node_m = unpack_range(range[range_index(level, at)].heights);
        range_m = vec2(min(range_m.x, node_m.x), max(range_m.y, node_m.y));
        at = at.x + 1 < end.x ? at + ivec2(1, 0) : ivec2(first.x, at.y + 1);
    }
    return range_m;
}

Projection project_square(ivec2 low, int side_log2) {
    ivec2 end = min(low + (1 << side_log2), u_last_post);
    return project(box_of(max(low, ivec2(0)), end, range_of_square_m(low, side_log2)), 1.0);
}

// The largest error in metres that is at most the tolerance in pixels: error_px() solved for the error.
float error_within_m(Projection p) {
    if (u_metric == METRIC_METRES) return u_tolerance_px;
    if (p.outside) return NEVER;
    float per_m = u_focal_px * p.stretch * BOUND_SLACK;
    return u_tolerance_px * p.nearest_m / (per_m + u_tolerance_px * abs(u_forward.z)) * (1.0 - 1e-5);
}

// A root mean square over a square certifies nothing about a part of it. So if a square is partly outside the picture,
// or if the map has voids, the maximum must be within the tolerance instead.
// Software renderers execute both sides of a branch, so each metric has its own shaders.
#ifdef MEAN
bool has_mean(Projection p) { return p.inside && u_has_voids == 0; }
#else
bool has_mean(Projection p) { return false; }
#endif

// A tile of the map's own cells has 4 × 4 of them. A smaller square looks at its cells themselves: four times as close a bound, or more.
const int FEW_LOG2 = 1;

// The finest level, from a given one on, at which a whole square is loaded.
int loaded_level(ivec2 low, int side_log2, int from) {
#ifdef PAGED
    bool is_mixed;
    return resident_level(low, low + (1 << side_log2), from, is_mixed);
#else
    return from;
#endif
}

// Whether a square has at most 2^most_log2 posts a side, and all of them are loaded.
bool has_posts(ivec2 low, int side_log2, int most_log2) { return side_log2 <= most_log2 && loaded_level(low, side_log2, 0) == 0; }

// Largest error and root mean square of such a square's cells, two triangles each; NEVER for other squares.
vec2 few_cells_m(ivec2 low, int side_log2) {
    ivec2 first = max(low, ivec2(0)), end = min(low + (1 << side_log2), u_last_post), cells = end - first;
    bool are_few = has_posts(low, side_log2, FEW_LOG2);
    float most_m = 0.0, squares_m2 = 0.0;
    for (ivec2 at = first; are_few && at.y < end.y; at = at.x + 1 < end.x ? at + ivec2(1, 0) : ivec2(first.x, at.y + 1)) {
        float t = is_hole(at) ? 0.0 : twist_m(at);
        most_m = max(most_m, abs(t));
        squares_m2 += t * t;
    }
    return are_few ? vec2(0.25 * most_m, 0.125 * sqrt(squares_m2 / float(cells.x * cells.y))) * (1.0 + exp2(-18.0)) : vec2(NEVER);
}

// The same for a spacing: below that of the posts, each cell of the map is cut into parts.
vec2 few_parts_m(int step_log2, vec2 few_m) { return step_log2 > 0 || few_m.x >= NEVER ? vec2(NEVER) : few_m * exp2(2.0 * float(step_log2)); }

float rms_of_box_m(ivec2 low, ivec2 end, int step_log2) {
    vec2 cells = vec2(min(end, u_last_post) - max(low, ivec2(0)));
    return sqrt(squares_m2(low, end, step_log2) / (cells.x * cells.y)) * (1.0 + exp2(-18.0));
}

// A unit of 1 post has neighbours of at most 2 posts in ring 0, and of 4 posts in other rings. These neighbours cannot be
// split, and an edge has at most 64 segments: along a side of 4 posts that is 16 between two posts.
int finest_step(int side_log2, int ring) {
    return max(side_log2 - MOST_SEGMENTS_LOG2, u_ring[ring].level == 0 ? FINEST : FINEST + 1);
}

// The coarsest spacing of a square: its corner is on the lattice of that spacing, so its cells are nodes of the tables.
int coarsest_step(ivec2 low, int side_log2) { return min(findLSB(low.x | low.y | 1 << side_log2), u_top_level); }

// Whether finer posts of a square are not loaded yet; `level` is the finest level at which the whole square is loaded.
bool is_waiting(ivec2 low, int side_log2, out int level) {
    int finest = max(side_log2 - MOST_SEGMENTS_LOG2, 0);
    level = loaded_level(low, side_log2, finest);
    return level > finest;
}

// The finest spacing that can reduce the error: finer triangles between the same posts cannot.
int finest_of(ivec2 low, int side_log2, int ring, int coarsest) {
    int level, finest = finest_step(side_log2, ring);
    return is_waiting(low, side_log2, level) ? max(finest, min(level, coarsest)) : finest;
}

// What the tables do not know: the Earth's curvature, and the rounding of vertices between posts, which neighbours may have.
float slack_m(int step_log2) { return sag_m(step_log2) + rounding_between_m(); }

// A patch of 2 × 2 segments over a node of the quadtree is a fan. One of 4 × 4 or 8 × 8 is a star, if the tessellator turns its diagonals to the
// middle (lod/star.py). Their triangles are known, whatever edges are cut, so their bounds are much closer than those of their cells.
#ifdef STARS
#define MOST_KNOWN_LOG2 3
#else
#define MOST_KNOWN_LOG2 1
#endif

// The errors of the node that a square is; the span if it is none.
NodeRange node_over(ivec2 low, int side_log2) {
    bool is_node = side_log2 >= 1 && side_log2 <= u_top_level && all(equal(low & (1 << side_log2) - 1, ivec2(0))) && all(greaterThanEqual(low, ivec2(0)));
    uint span = pack_pair(vec2(u_span_m));
    return is_node ? range[range_index(side_log2, low >> side_log2)] : NodeRange(0u, span, span);
}

// The largest error of a fan or star and its root mean square; the span if there is no such bound.
vec2 known_m(NodeRange node, ivec2 low, int side_log2, int step_log2) {
    int segments_log2 = side_log2 - step_log2;
    if (segments_log2 < 1 || segments_log2 > MOST_KNOWN_LOG2) return vec2(u_span_m);
    if (loaded_level(low, side_log2, step_log2) > step_log2) return vec2(u_span_m);
    vec2 stars_m = unpack_pair(node.stars_m);
    return segments_log2 == 1 ? unpack_pair(node.fan_m) : segments_log2 == 2 ? stars_m.xx : stars_m.yy;
}

// The mean over the cells on the map, from the mean over a node's posts. At the map's rim it has more of them.
float rms_of_node_m(ivec2 low, int side_log2, float rms_m) {
    vec2 cells = vec2(min(low + (1 << side_log2), u_last_post) - low);
    return rms_m * sqrt(own_posts(side_log2, low >> side_log2) / (cells.x * cells.y)) * (1.0 + exp2(-18.0));
}

bool holds_as_known(NodeRange node, ivec2 low, int side_log2, int step_log2, Projection p) {
    vec2 errors_m = known_m(node, low, side_log2, step_log2);
    p.sag_m = slack_m(step_log2);
    if (!has_mean(p)) return errors_m.x <= error_within_m(p) - p.sag_m;
    return error_px(p, rms_of_node_m(low, side_log2, errors_m.y), errors_m.x) <= u_tolerance_px * (1.0 - 1e-5);
}

// Largest error and root mean square of a square's cells: from the tables, or of a few cells themselves.
vec2 cells_m(ivec2 low, int side_log2, int step_log2, vec2 few_m) {
    ivec2 end = low + (1 << side_log2);
    vec2 of_few_m = few_parts_m(step_log2, few_m);
    return of_few_m.x < NEVER ? of_few_m : vec2(largest_m(low, end, step_log2), rms_of_box_m(low, end, step_log2));
}

// Whether the cells of a square are within the tolerance.
bool holds(ivec2 low, int side_log2, int step_log2, vec2 few_m, Projection p, float within_m) {
    p.sag_m = slack_m(step_log2);
    float allowed_m = within_m - p.sag_m, of_few_m = few_parts_m(step_log2, few_m).x;
    vec2 errors_m = cells_m(low, side_log2, step_log2, few_m);
    if (has_mean(p)) return error_px(p, errors_m.y, errors_m.x) <= u_tolerance_px * (1.0 - 1e-5);
    return allowed_m >= 0.0 && (of_few_m < NEVER ? of_few_m <= allowed_m : is_within_m(low, low + (1 << side_log2), step_log2, allowed_m));
}

// The coarsest spacing, from `coarsest` to `finest`, that the tables allow; NO_STEP if there is none.
int next_step(ivec2 low, int side_log2, int coarsest, int finest, Projection p) {
    float within_m = error_within_m(p);
    vec2 few_m = few_cells_m(low, side_log2);
    for (int step_log2 = coarsest; step_log2 >= finest; step_log2--)
        if (holds(low, side_log2, step_log2, few_m, p, within_m)) return step_log2;
    return NO_STEP;
}

// The same, but a square may also be a fan or a star. `is_alone`: it holds only as such, so no pair may have it. `known` is a spacing
// that the tables allow, or NO_STEP.
int next_step_or_known(ivec2 low, int side_log2, int ring, int coarsest, int known, Projection p, out bool is_alone) {
    int finest = known != NO_STEP ? known + 1 : finest_of(low, side_log2, ring, coarsest), alone = NO_STEP;
    NodeRange node = node_over(low, side_log2);
    for (int k = MOST_KNOWN_LOG2; k >= 1; k--)
        if (side_log2 - k >= finest && side_log2 - k <= coarsest && holds_as_known(node, low, side_log2, side_log2 - k, p)) alone = side_log2 - k;
    int step_log2 = next_step(low, side_log2, coarsest, alone != NO_STEP ? alone : finest, p);
    is_alone = alone != NO_STEP && step_log2 == NO_STEP;
    return is_alone ? alone : step_log2 == NO_STEP ? known : step_log2;
}

float bound_px(Projection p, float rms_m, float max_m) {
    if (u_metric == METRIC_METRES) return max_m + p.sag_m;
    return error_px(p, has_mean(p) ? min(rms_m, max_m) : max_m, max_m);
}

// What the tables certify of a square, in the metric asked for: pixels, or metres over the whole map.
float square_px(ivec2 low, int side_log2, int step_log2, bool is_alone) {
    Projection p = project_square(low, side_log2);
    if (p.outside) return 0.0;
    p.sag_m = slack_m(step_log2);
    vec2 errors_m = cells_m(low, side_log2, step_log2, few_cells_m(low, side_log2));
    if (is_alone) {
        vec2 of_known_m = known_m(node_over(low, side_log2), low, side_log2, step_log2);
        errors_m = min(errors_m, vec2(of_known_m.x, rms_of_node_m(low, side_log2, of_known_m.y)));
    }
    return bound_px(p, errors_m.y, errors_m.x);
}

// The largest of that over a leaf's squares.
float leaf_px(Leaf leaf) {
    int side_log2 = side_log2_of(leaf);
    ivec2 last = (ivec2(1) << leaf.size_log2 - side_log2) - 1;
    float px = 0.0;
    for (int k = 0; k <= last.x + last.y; k++)
        px = max(px, square_px(leaf.origin + (min(ivec2(k), last) << side_log2), side_log2, step_log2_of(leaf.word), last == ivec2(0)));
    return px;
}
