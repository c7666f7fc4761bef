// view/overlay.vert — the window's text: one instance is one glyph, or one panel behind them.
//   Positions are pixels of the picture, origin at its top left, y down.
// Python twin: viewer.overlay.RECT

in ivec4 in_box;        // left, top, width, height
in int in_glyph;        // place in the atlas; -1: a panel
in vec4 in_color;

uniform vec2 u_size_px;

out vec2 v_at_px;       // from the box's top left
flat out ivec2 v_box_px;
flat out int v_glyph;
flat out vec4 v_color;

void main() {
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    vec2 at = vec2(in_box.xy) + corner * vec2(in_box.zw);
    v_at_px = corner * vec2(in_box.zw);
    v_box_px = in_box.zw;
    v_glyph = in_glyph;
    v_color = in_color;
    vec2 clip = 2.0 * at / u_size_px - 1.0;
    gl_Position = vec4(clip.x, -clip.y, 0.0, 1.0);
}
