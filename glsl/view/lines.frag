// view/lines.frag — a line's colour: soft at its sides, faint where the land hides it.

in vec4 v_color;
in float v_across;
noperspective in float v_depth;

#ifndef SAMPLES
#define SAMPLES 4
#endif
#if SAMPLES > 1
layout(binding = 2) uniform sampler2DMS u_depth;
#define SIZE textureSize(u_depth)
#else
layout(binding = 2) uniform sampler2D u_depth;
#define SIZE textureSize(u_depth, 0)
#endif

uniform vec2 u_window_px;
uniform float u_width_px;
uniform int u_left_px;  // of the picture in the window

out vec4 out_color;

void main() {
    // reversed: nearer is larger
    float land = texelFetch(u_depth, ivec2((gl_FragCoord.xy - vec2(u_left_px, 0.0)) / u_window_px * vec2(SIZE)), 0).x;
    float seen = v_depth >= land * 0.985 ? 1.0 : 0.25;
    float sharp = clamp((1.0 - abs(v_across)) * 0.5 * (u_width_px + 1.0), 0.0, 1.0);
    out_color = vec4(v_color.rgb, v_color.a * sharp * seen);
}
