// horizon/sweep.comp — the height of the horizon towards a light, at every post.
// Python twin: reference.horizon_sines

#include "horizon/hull.glsl"

// Height between two posts; outside the map, the slope at the rim continues.
float line_height_m(int step_, int place) {
    float aside = slack(u_towards, step_);
    int beside = place + (aside < 0.0 ? -1 : 1), last = on_axes(u_towards, u_last_post).y;
    bool is_outside = beside < 0 || beside > last;
    if (is_outside) beside = 2 * place - beside;
    return mix(height_m(post_at(u_towards, step_, place)), height_m(post_at(u_towards, step_, beside)),
        is_outside ? -abs(aside) : abs(aside));
}

void main() {
    int own = int(gl_GlobalInvocationID.x), line = u_first_line + own;
    if (own >= u_lines) return;
    ivec2 last = on_axes(u_towards, u_last_post);
    int points = 0;
    for (int i = 0; i <= last.x; i++) {
        int place = line + base(u_towards, i);
        if (place < 0 || place > last.y) continue;
        vec4 record = horizon_record(own, points, Point(line_height_m(i, place), float(i)));
        imageStore(u_horizon, ivec3(post_at(u_towards, i, place), u_layer), record);
    }
}
