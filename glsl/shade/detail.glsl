// shade/detail.glsl — the first pass for styles that show the mesh:
//   it stores facts about the mesh at each sample, besides its depth.
// Provides put_detail().

#include "shade/place.glsl"
#include "blocks/view.glsl"

in vec2 g_post;
in vec3 g_from_eye_m;
flat in uvec4 g_of_patch;
in vec3 g_weights;

layout(location = 0) out vec4 out_drawn;
// x: log2 of the posts between vertices; y: triangle's edge, 0 to 1;
// z: log2 of the segments a side, whole, plus the patch's border, 0 to 1; w: px of put_detail()

// Lines are one pixel wide, and fainter on small triangles.
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

// Store the facts. px is the bound in pixels for style "promise", 1 at a crack for "cracks", else the error in pixels.
void put_detail(float px) {
    Patch p = patch_of(g_of_patch);
    vec2 post_per_px = fwidth(g_post);
    if (is_in_hole(place_in_patch(g_post, p))) discard;
    ivec2 size = p.high - p.low;
    float segments_log2 = round(log2(float(min(size.x, size.y))) - p.step_log2);
    float border = segments_log2 + min(border_line(g_post, p, post_per_px), 0.99);
    out_drawn = vec4(p.step_log2, edge_line(), border, min(px, 6e4));
}
