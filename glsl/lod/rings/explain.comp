// lod/rings/explain.comp — what the tables say about a patch of the clipmap: its error with T = 1, 2, 4, ... 64 segments a side.
// One thread for each T.

#include "lod/rings/leaf.glsl"

layout(local_size_x = SIZES) in;
layout(std430, binding = 4) writeonly buffer Answer {
    vec4 projection;     // least depth in metres, stretch, whether wholly in the picture, whether wholly outside
    vec4 range_m;        // lowest and highest height
    vec4 choice[SIZES];  // largest error in metres, RMS error in metres, bound in pixels, 1; all 0 without tables for the spacing
};

uniform ivec2 u_low;      // post of the patch's north-west corner
uniform int u_side_log2;  // log2 of its side in posts

void main() {
    int k = int(gl_LocalInvocationIndex), step_log2 = u_side_log2 - k;
    Projection p = project_square(u_low, u_side_log2);
    if (k == 0) {
        projection = vec4(p.nearest_m, p.stretch, p.inside, p.outside);
        range_m = vec4(range_of_square_m(u_low, u_side_log2), 0.0, 0.0);
    }
    bool known = step_log2 <= u_top_level && step_log2 >= FINEST && all(equal(u_low & (1 << max(step_log2, 0)) - 1, ivec2(0)));
    choice[k] = vec4(0.0);
    if (!known) return;
    p.sag_m = slack_m(step_log2);
    vec2 cells = cells_m(u_low, u_side_log2, step_log2, few_cells_m(u_low, u_side_log2));
    float max_m = cells.x, rms_m = min(cells.y, max_m);
    vec2 of_known_m = known_m(node_over(u_low, u_side_log2), u_low, u_side_log2, step_log2);
    max_m = min(max_m, of_known_m.x);
    rms_m = min(min(rms_m, rms_of_node_m(u_low, u_side_log2, of_known_m.y)), max_m);
    choice[k] = vec4(vec2(max_m, rms_m) + p.sag_m, p.outside ? 0.0 : error_px(p, u_metric == METRIC_RMS && has_mean(p) ? rms_m : max_m, max_m), 1.0);
}
