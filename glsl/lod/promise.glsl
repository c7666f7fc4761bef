// lod/promise.glsl — what the tables say of 2^size × 2^size quads of a level, drawn as one patch: in metres, and on the
// screen. One quad, and two by two, are their own records; larger squares ask the summed-area tables.
// Provides square_errors_m(), is_whole(), quads_px().   `at` is the square's north-west node, a multiple of its side

#include "lod/tree.glsl"
#include "error/bound.glsl"

vec2 square_errors_m(int size, int level, ivec2 at) {
    if (level == 0) return vec2(0.0);
    if (size > 1) {
        float max_m = bound_max_m(level, at, 1 << size);
        return vec2(max_m, mean_is_known(node_of(level + size, at >> size)) ? bound_rms_m(level, at, 1 << size) : max_m);
    }
    vec2 worst = vec2(0.0);
    for (int i = 0; i < 1 << 2 * size; i++) {
        PackedNode n = node_of(level, at + ivec2(i & 1, i >> 1));
        worst = max(worst, vec2(unpack_pair(n.max_m).x, posts_rms_m(n).x));
    }
    return worst;
}

// Whether nothing of the square lies beyond the map.
bool is_whole(int size, int level, ivec2 at) {
    return level + size <= u_top_level && all(lessThanEqual((at + (1 << size)) << level, u_last_post));
}

float quads_px(int size, int level, ivec2 at) {
    Projection p = project_node(level + size, at >> size, 1.0);
    vec2 errors_m = square_errors_m(size, level, at);
    return p.outside ? 0.0 : metric_px(p, errors_m.x, errors_m.y);
}
