// horizon/sweep.comp — the height of the horizon towards a light, at every post. One thread marches along one line.
//   Only a point of the upper convex hull of the points that a line has passed can be the horizon of the next point
//   (Timonen and Westerholm 2010, "Scalable height field self-shadowing"). The tangent from the new point to the hull
//   gives the horizon.
//   All hull points below the tangent are removed for good.
//
//      light ←      q₂                        horizon(p) = direction of q₁, because q₂ is lower in the sky than q₁
//            ·   ▟███▙    q₁                  the hull behind p is now p → q₁ → …, and q₀ is forgotten
//             ▟███████▙▟██▙  q₀
//            ███████████████▙▟█▙    p
//
//   A point enters the hull once and leaves it once, so the cost of a post does not depend
//   on the distance of its horizon.
//   Python twin: reference.horizon_sines

#include "horizon/lines.glsl"

layout(local_size_x = 64) in;
layout(r16, binding = 0) uniform writeonly image2DArray u_horizon;  // sine of the horizon's height: 0 for −1, 1 for 1

// A point of a hull: its height in metres, as bits, and the hull's next point towards the light, as a step;
// −1 at its end.
layout(std430, binding = 0) buffer Hulls { ivec2 hull[]; };  // one hull for each line of this run: steps × lines

uniform vec2 u_towards;    // see lines.glsl
uniform int u_layer;       // layer of the image
uniform int u_first_line;  // first line of this run; then the number of its lines
uniform int u_lines;

// Height between two posts; outside the map, the slope at the rim continues.
float line_height_m(int step_, int place) {
    float aside = slack(u_towards, step_);
    int beside = place + (aside < 0.0 ? -1 : 1), last = on_axes(u_towards, u_last_post).y;
    bool is_outside = beside < 0 || beside > last;
    if (is_outside) beside = 2 * place - beside;
    return mix(height_m(post_at(u_towards, step_, place)), height_m(post_at(u_towards, step_, beside)),
        is_outside ? -abs(aside) : abs(aside));
}

// The steps in which a line is on the map, and one more on either side.
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
    ivec2 point = ivec2(0, -1);  // the newest point of the hull: it needs no fetch
    for (int i = cross_.x; i <= cross_.y; i++) {
        int place = line + base(u_towards, i);
        if (place < 0 || place > last.y) continue;

        float h_m = line_height_m(i, place), rise = -1e30;
        int tangent = -1;
        for (int q = newest; q >= 0;) {
            float rise_to = (intBitsToFloat(point.x) - h_m) / float(i - q);
            if (tangent >= 0 && rise_to < rise) break;
            rise = rise_to;
            tangent = q;
            q = point.y;
            if (q >= 0) point = hull[q * u_lines + own];
        }
        hull[i * u_lines + own] = point = ivec2(floatBitsToInt(h_m), tangent);
        newest = i;
        float slope = rise / step_m(u_towards), sine = tangent < 0 ? -1.0 : slope * inversesqrt(1.0 + slope * slope);
        imageStore(u_horizon, ivec3(post_at(u_towards, i, place), u_layer), vec4(0.5 + 0.5 * sine));
    }
}
