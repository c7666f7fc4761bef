// horizon/sweep.comp — how high the horizon stands towards a light, at every post: one thread marches along one line.
//   Of all that a line has passed, only the upper convex hull can be on the horizon of what comes next (Timonen and
//   Westerholm 2010, "Scalable height field self-shadowing"). The tangent from a new point to the hull finds the horizon;
//   all that lies under the tangent leaves the hull for good.
//
//      light ←      q₂                        horizon(p) = direction of q₁, because q₂ is lower in the sky than q₁
//            ·   ▟███▙    q₁                  the hull behind p is now p → q₁ → …, and q₀ is forgotten
//             ▟███████▙▟██▙  q₀
//            ███████████████▙▟█▙    p
//
//   A point enters the hull once and leaves it once: the cost of a post does not depend on how far its horizon is.
//   Python twin: reference.horizon_sines

#include "horizon/lines.glsl"

layout(local_size_x = 64) in;
layout(r16, binding = 0) uniform writeonly image2DArray u_horizon;  // sine of the horizon's height: 0 for −1, 1 for 1

struct Point {
    float height_m;
    int before;  // the hull's next point towards the light, as a step; −1 at its end
};

layout(std430, binding = 0) buffer Hulls { Point hull[]; };  // steps × lines of this run

uniform vec2 u_towards;    // see lines.glsl
uniform int u_layer;       // of the image
uniform int u_first_line;  // of this run, and how many
uniform int u_lines;

// Between two posts; beside the rim, the slope within it goes on.
float line_height_m(int step_, int place) {
    float aside = slack(u_towards, step_);
    int beside = place + (aside < 0.0 ? -1 : 1), last = on_axes(u_towards, u_last_post).y;
    bool is_outside = beside < 0 || beside > last;
    if (is_outside) beside = 2 * place - beside;
    return mix(height_m(post_at(u_towards, step_, place)), height_m(post_at(u_towards, step_, beside)), is_outside ? -abs(aside) : abs(aside));
}

// Steps between which a line crosses the map, with one to spare on either side.
ivec2 crossing(int line, ivec2 last) {
    float slide_ = slide(u_towards);
    if (slide_ == 0.0) return ivec2(0, last.x);
    vec2 at = vec2(-line, last.y - line) / slide_;
    float reach = 0.5 / abs(slide_) + 1.0;
    return ivec2(clamp(vec2(min(at.x, at.y) - reach, max(at.x, at.y) + reach), vec2(0.0), vec2(last.x)));
}

void main() {
    int own = int(gl_GlobalInvocationID.x), line = u_first_line + own;
    if (own >= u_lines) return;

    ivec2 last = on_axes(u_towards, u_last_post), cross_ = crossing(line, last);
    int newest = -1;
    for (int i = cross_.x; i <= cross_.y; i++) {
        int place = line + base(u_towards, i);
        if (place < 0 || place > last.y) continue;

        float h_m = line_height_m(i, place), rise = -1e30;
        int tangent = -1;
        for (int q = newest; q >= 0;) {
            Point p = hull[q * u_lines + own];
            float rise_to = (p.height_m - h_m) / float(i - q);
            if (tangent >= 0 && rise_to < rise) break;
            rise = rise_to;
            tangent = q;
            q = p.before;
        }
        hull[i * u_lines + own] = Point(h_m, tangent);
        newest = i;
        float slope = rise / step_m(u_towards), sine = tangent < 0 ? -1.0 : slope * inversesqrt(1.0 + slope * slope);
        imageStore(u_horizon, ivec3(post_at(u_towards, i, place), u_layer), vec4(0.5 + 0.5 * sine));
    }
}
