// horizon/hull.glsl — the horizon of each point of a line that runs away from a light.
//   One thread marches along one line. Only a point of the upper convex hull of the points that a line has passed can
//   be the horizon of the next point (Timonen and Westerholm 2010, "Scalable height field self-shadowing"). The tangent
//   from the new point to the hull gives the horizon. All hull points below the tangent are removed for good.
//
//      light ←      q₂                        horizon(p) = direction of q₁, because q₂ is lower in the sky than q₁
//            ·   ▟███▙    q₁                  the hull behind p is now p → q₁ → …, and q₀ is forgotten
//             ▟███████▙▟██▙  q₀
//            ███████████████▙▟█▙    p
//
//   A point enters the hull once and leaves it at most once, so the cost of a post does not depend
//   on the distance of its horizon.
// Provides horizon_record().   Python twins: reference.horizon_sines, reference.windowed_sines

#include "horizon/lines.glsl"

layout(local_size_x = 64) in;
layout(r16, binding = 0) uniform writeonly image2DArray u_horizon;  // sine of the horizon's height: 0 for −1, 1 for 1

struct Point {
    float height_m;
    float at;  // steps along the line
};

layout(std430, binding = 0) buffer Hulls { Point hull[]; };  // one hull for each line of this run: points × lines

uniform vec2 u_towards;             // see lines.glsl
uniform int u_layer;                // layer of the image
uniform int u_first_line, u_lines;  // first line of this run, and their number

// The record of the horizon of a point on line `own`. The point is then the last of the hull's points.
vec4 horizon_record(int own, inout int points, Point p) {
    float rise = -1e30;  // metres a step
    int tangent = -1;
    for (int q = points - 1; q >= 0; q--) {
        Point behind = hull[q * u_lines + own];
        float rise_to = (behind.height_m - p.height_m) / (p.at - behind.at);
        if (tangent >= 0 && rise_to < rise) break;
        rise = rise_to;
        tangent = q;
    }
    points = tangent + 2;
    hull[(tangent + 1) * u_lines + own] = p;
    float slope = rise / step_m(u_towards), sine = tangent < 0 ? -1.0 : slope * inversesqrt(1.0 + slope * slope);
    return vec4(0.5 + 0.5 * sine);
}
