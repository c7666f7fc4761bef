// rings/explain.comp — a patch of the clipmap, and how far off it would be with T = 1, 2, 4, ... 64 segments a side: what the
// tables say of its cells. One thread a T.

#include "rings/leaf.glsl"

layout(local_size_x = SIZES) in;
layout(std430, binding = 4) writeonly buffer Answer {
    vec4 projection;     // least depth in metres, stretch, wholly in the picture, wholly outside
    vec4 range_m;        // lowest and highest
    vec4 choice[SIZES];  // largest error and root mean square in metres, pixels; 0 if the tables do not know this spacing
};

uniform ivec2 u_low;      // post of the patch's north-west corner
uniform int u_side_log2;  // posts

void main() {
    int k = int(gl_LocalInvocationIndex), step_log2 = u_side_log2 - k;
    ivec2 end = u_low + (1 << u_side_log2);
    Projection p = project_square(u_low, u_side_log2);
    if (k == 0) {
        projection = vec4(p.nearest_m, p.stretch, p.inside, p.outside);
        range_m = vec4(range_of_square_m(u_low, u_side_log2), 0.0, 0.0);
    }
    bool known = step_log2 <= u_top_level && step_log2 >= FINEST && all(equal(u_low & (1 << max(step_log2, 0)) - 1, ivec2(0)));
    choice[k] = vec4(0.0);
    if (!known) return;
    float max_m = largest_m(u_low, end, step_log2), rms_m = rms_of_box_m(u_low, end, step_log2);
    choice[k] = vec4(max_m, rms_m, p.outside ? 0.0 : error_px(p, u_metric == METRIC_RMS && has_mean(p) ? rms_m : max_m, max_m), 1.0);
}
