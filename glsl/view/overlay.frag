// view/overlay.frag — a glyph's coverage from the atlas, texel for pixel; a panel's from its distance to a rounded box.
//   d(p) = |max(|p| - b + r, 0)| - r   for a box of half size b, corners of radius r, p from its middle (Quilez 2010)

in vec2 v_at_px;
flat in ivec2 v_box_px;
flat in int v_glyph;
flat in vec4 v_color;

uniform float u_radius_px;
layout(binding = 0) uniform sampler2D u_atlas;  // glyphs side by side

out vec4 out_color;

float panel() {
    vec2 half_px = 0.5 * vec2(v_box_px);
    float radius = min(u_radius_px, min(half_px.x, half_px.y));
    float distance_px = length(max(abs(v_at_px - half_px) - half_px + radius, 0.0)) - radius;
    return clamp(0.5 - distance_px, 0.0, 1.0);
}

float glyph() { return texelFetch(u_atlas, ivec2(v_at_px) + ivec2(v_glyph * v_box_px.x, 0), 0).x; }

void main() {
    float coverage = v_glyph < 0 ? panel() : glyph();
    out_color = vec4(v_color.rgb, v_color.a * coverage);
}
