// shade/detail.frag — the first pass for styles that show the mesh itself: the place, as in shade/surface.frag, and what
// is drawn there.

#include "shade/place.glsl"
#include "blocks/view.glsl"

in vec2 g_post;
in vec3 g_from_eye_m;
flat in uvec4 g_of_patch;
in vec3 g_weights;

layout(location = 0) out vec2 out_post;
layout(location = 1) out vec4 out_drawn;  // level, negative for fans; triangle's edge and patch's border 0 to 1; error px

// Lines are a pixel wide, and faint where the triangle has no room for them.
float edge_line() {
    vec3 per_px = max(sqrt(dFdx(g_weights) * dFdx(g_weights) + dFdy(g_weights) * dFdy(g_weights)), 1e-9);
    vec3 edge_px = g_weights / per_px;
    float height_px = 1.0 / max(max(per_px.x, per_px.y), per_px.z);
    return (1.0 - smoothstep(0.4, 1.1, min(min(edge_px.x, edge_px.y), edge_px.z))) * clamp(height_px / 6.0, 0.08, 1.0);
}

float border_line(vec2 post, Patch p, vec2 post_per_px) {
    vec2 side = vec2(p.high - p.low), inside = post - vec2(p.low);
    vec2 px = min(inside, side - inside) / max(post_per_px, 1e-9);
    vec2 room = side / max(post_per_px, 1e-9);
    return (1.0 - smoothstep(0.5, 1.2, min(px.x, px.y))) * clamp(min(room.x, room.y) / 8.0, 0.1, 1.0);
}

// The truth between posts is either of a cell's two pairs of triangles: the one nearer to what is drawn.
float error_m(vec2 post, float drawn_m) {
    ivec2 at = min(ivec2(post), u_last_post - 1);
    vec2 t = post - vec2(at);
    float a = height_m(at), b = height_m(at + ivec2(1, 0)), c = height_m(at + ivec2(0, 1)), d = height_m(at + 1);
    float falling = t.x >= t.y ? a + (b - a) * t.x + (d - b) * t.y : a + (c - a) * t.y + (d - c) * t.x;
    float rising = t.x + t.y <= 1.0 ? a + (b - a) * t.x + (c - a) * t.y : d + (c - d) * (1.0 - t.x) + (b - d) * (1.0 - t.y);
    float one = drawn_m - falling, other = drawn_m - rising;
    return abs(one) < abs(other) ? one : other;
}

// Distance on the screen between the point drawn and the true one, d below it: method of lod/project.glsl, exact.
float error_px(vec3 drawn_m, float d) {
    float z = dot(drawn_m, u_forward.xyz), true_z = z - d * u_forward.z;
    vec2 at = vec2(dot(drawn_m, u_right.xyz), dot(drawn_m, u_up.xyz));
    return u_focal_px * abs(d) * length(vec2(u_right.z, u_up.z) * z - at * u_forward.z) / max(z * abs(true_z), 1e-30);
}

void main() {
    Patch p = patch_of(g_of_patch);
    vec2 post_per_px = fwidth(g_post);
    out_post = place_in_patch(g_post, p);
    if (is_in_hole(out_post)) discard;
    bool inside = min(min(g_weights.x, g_weights.y), g_weights.z) >= 0.0;  // else the neighbour's fragment knows
    float px = inside ? min(error_px(g_from_eye_m, error_m(out_post, g_from_eye_m.z + u_eye_z_m + u_eye_z_rest_m)), 6e4) : 0.0;
    out_drawn = vec4((p.step_log2 + 1.0) * (p.fan ? -1.0 : 1.0), edge_line(), border_line(g_post, p, post_per_px), px);
}
