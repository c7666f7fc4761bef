// view/lines.vert — lines over the land: one instance is one segment, drawn as a quad a few pixels wide.
//   Segments are clipped at the near plane before the projection;
//   else points behind the eye would appear in front of it.
// Record: lines.PIECE

#include "blocks/view.glsl"

in vec3 in_a_m, in_b_m;  // ends: metres east, north, up from the eye
in vec4 in_color;

uniform vec2 u_window_px;
uniform float u_width_px;

out vec4 v_color;
out float v_across;  // -1 to 1
noperspective out float v_depth;

void main() {
    vec4 a = u_clip_from_eye * vec4(in_a_m, 1.0), b = u_clip_from_eye * vec4(in_b_m, 1.0);
    float near = near_m() * 1.001;
    v_color = in_color;
    gl_Position = vec4(2.0, 2.0, 0.0, 1.0);
    if (a.w < near && b.w < near) return;
    if (a.w < near) a = mix(b, a, (b.w - near) / (b.w - a.w));
    if (b.w < near) b = mix(a, b, (a.w - near) / (a.w - b.w));
    vec2 along = (b.xy / b.w - a.xy / a.w) * u_window_px;
    vec2 across = length(along) > 1e-6 ? normalize(vec2(-along.y, along.x)) : vec2(0.0);
    vec4 end = (gl_VertexID & 1) == 0 ? a : b;
    v_across = float(gl_VertexID >> 1) * 2.0 - 1.0;
    v_depth = end.z / end.w;
    gl_Position = vec4(end.xy / end.w + across * v_across * (u_width_px + 1.0) / u_window_px, 0.0, 1.0);
}
