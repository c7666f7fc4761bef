// lod/rings/explain.comp — what the tables say about a patch of the clipmap: its error with T = 1, 2, 4, ... 64
//   segments a side.
// One thread for each T.

#include "lod/rings/leaf.glsl"

layout(local_size_x = SIZES) in;
layout(std430, binding = 4) writeonly buffer Answer {
    vec4 projection;     // least depth in metres, stretch, whether wholly in the picture, whether wholly outside
    vec4 range_m;        // lowest and highest height
    // largest error in metres, RMS error in metres, bound in pixels, 1; all 0 without tables for the spacing
    vec4 choice[SIZES];
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
    bool is_known = step_log2 <= coarsest_step(u_low, u_side_log2) && step_log2 >= FINEST;
    choice[k] = vec4(0.0);
    if (!is_known) return;
    p.sag_m = slack_m(step_log2);
    vec2 errors_m = cells_m(u_low, u_side_log2, step_log2, few_cells_m(u_low, u_side_log2));
    float rms_m = min(errors_m.y, errors_m.x);
    float px = error_px(p, u_metric == METRIC_RMS && has_mean(p) ? rms_m : errors_m.x, errors_m.x);
    choice[k] = vec4(vec2(errors_m.x, rms_m) + p.sag_m, p.outside ? 0.0 : px, 1.0);
}
