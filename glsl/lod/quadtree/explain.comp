// lod/quadtree/explain.comp — the errors of one square of the map, drawn with 1, 2, 4, ... segments. A thread a level.

#include "lod/quadtree/patch_bound.glsl"

layout(local_size_x = 16) in;

struct Choice {
    // As quads of this level: largest error and RMS in metres, bound in pixels, 1; all 0 if there is no such choice.
    vec4 quads;
    vec4 fan;    // the same for one fan, if the square is a node of this level
};
layout(std430, binding = 5) writeonly buffer Answer {
    vec4 projection;  // smallest depth in metres, stretch, entirely in the picture, entirely outside
    vec4 range_m;     // lowest and highest height
    Choice choice[];
};

uniform ivec2 u_low;      // post of the square's north-west corner
uniform int u_side_log2;  // log2 of its side in posts
uniform uint u_edges;     // split edges of a fan: bits W, N, E, S

void main() {
    int level = int(gl_LocalInvocationID.x);
    int node_level = max(u_side_log2, 1);
    if (level == 0) {
        Projection p = project_node(u_side_log2, u_low >> u_side_log2, 1.0);
        projection = vec4(p.nearest_m, p.stretch, p.inside, p.outside);
        range_m = vec4(range_of(node_level, u_low >> node_level), 0.0, 0.0);
    }
    if (level > u_side_log2) return;
    int size = u_side_log2 - level;
    ivec2 at = u_low >> level;
    choice[level].quads = vec4(0.0);
    choice[level].fan = vec4(0.0);
    if (size == 0 || is_whole(size, level, at))
        choice[level].quads = vec4(square_errors_m(size, level, at) + sag_m(level), quads_px(size, level, at), 1.0);
    if (size == 0 && level > 0) {
        PackedNode n = node_of(level, at);
        Projection p = project_node(level, at, 1.0);
        choice[level].fan = vec4(vec2(fan_max_m(n, u_edges), posts_rms_m(n).y) + p.sag_m,
            p.outside ? 0.0 : fan_px(p, n, u_edges), 1.0);
    }
}
