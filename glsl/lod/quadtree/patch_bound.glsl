// lod/quadtree/patch_bound.glsl — the bound of 2^size × 2^size quads of a level, drawn as one patch,
//   in metres and in pixels. One quad and 2 × 2 quads use their records; larger squares use the summed-area tables.
// Provides square_errors_m(), is_whole(), quads_px().   `at` is the square's north-west node, a multiple of its side
// Python twins: reference.bound_max_m, reference.bound_rms_m

#include "lod/quadtree/tree.glsl"
#include "error/bound.glsl"

vec2 square_errors_m(int size, int level, ivec2 at) {
    if (level == 0) return vec2(0.0);
    if (size > 1) {
        ivec2 low = at << level, end = (at + (1 << size)) << level;
        float max_m = largest_m(low, end, level), side = float(1 << level + size);
        return vec2(max_m, mean_is_known(node_of(level + size, at >> size)) ? sqrt(squares_m2(low, end, level)) / side
            : max_m);
    }
    vec2 worst = vec2(0.0);
    for (int i = 0; i < 1 << 2 * size; i++) {
        PackedNode n = node_of(level, at + ivec2(i & 1, i >> 1));
        worst = max(worst, vec2(unpack_pair(n.max_m).x, posts_rms_m(n).x));
    }
    return worst;
}

// Whether the whole square is on the map.
bool is_whole(int size, int level, ivec2 at) {
    return level + size <= u_top_level && all(lessThanEqual((at + (1 << size)) << level, u_last_post));
}

float quads_px(int size, int level, ivec2 at) {
    Projection p = project_node(level + size, at >> size, 1.0);
    p.sag_m = sag_m(level);
    vec2 errors_m = square_errors_m(size, level, at);
    return p.outside ? 0.0 : metric_px(p, errors_m.x, errors_m.y);
}
