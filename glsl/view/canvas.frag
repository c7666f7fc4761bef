// view/canvas.frag — copy the composed picture to the window; under the magnifying glass its pixels are squares.

layout(binding = 2) uniform sampler2D u_canvas;

uniform vec4 u_lens;  // centre of the glass, its radius in pixels (0 without a glass), magnification
uniform float u_divider_px;  // column where the two sides meet; negative for one side

out vec4 out_colour;

void main() {
    vec2 at = gl_FragCoord.xy;
    float beyond_px = distance(at, u_lens.xy) - u_lens.z;
    if (beyond_px < 0.0) at = u_lens.xy + (at - u_lens.xy) / u_lens.w;
    ivec2 last = textureSize(u_canvas, 0) - 1;
    vec3 colour = texelFetch(u_canvas, clamp(ivec2(floor(at)), ivec2(0), last), 0).rgb;
    if (u_divider_px >= 0.0)
        colour = mix(colour, vec3(1.0), 0.85 * clamp(1.5 - abs(gl_FragCoord.x - u_divider_px), 0.0, 1.0));
    if (u_lens.z > 0.0) colour = mix(colour, vec3(1.0, 0.80, 0.47), clamp(2.0 - abs(beyond_px), 0.0, 1.0));
    out_colour = vec4(colour, 1.0);
}
