// view/gui.vert — the panels' triangles, in pixels of the picture, origin at its top left, y down.

in vec2 in_at_px;
in vec2 in_texel;
in vec4 in_color;

uniform vec2 u_size_px;

out vec2 v_texel;
out vec4 v_color;

void main() {
    v_texel = in_texel;
    v_color = in_color;
    vec2 clip = 2.0 * in_at_px / u_size_px - 1.0;
    gl_Position = vec4(clip.x, -clip.y, 0.0, 1.0);
}
