// view/canvas.frag — show one picture, or parts of two; under the magnifying glass its pixels are squares.

layout(binding = 2) uniform sampler2D u_left;
layout(binding = 3) uniform sampler2D u_right;

uniform vec4 u_lens;  // centre of the glass, its radius in pixels (0 without a glass), magnification
uniform float u_divider_px;  // column where the two sides meet; negative for one side
uniform ivec2 u_shift;  // columns by which the left and the right picture are moved

out vec4 out_colour;

vec3 texel(sampler2D picture, ivec2 at) {
    return texelFetch(picture, clamp(at, ivec2(0), textureSize(picture, 0) - 1), 0).rgb;
}

void main() {
    vec2 place = gl_FragCoord.xy;
    float beyond_px = distance(place, u_lens.xy) - u_lens.z;
    if (beyond_px < 0.0) place = u_lens.xy + (place - u_lens.xy) / u_lens.w;
    ivec2 at = ivec2(floor(place));
    bool is_left = u_divider_px < 0.0 || at.x < int(roundEven(u_divider_px));
    vec3 colour = is_left ? texel(u_left, at - ivec2(u_shift.x, 0)) : texel(u_right, at - ivec2(u_shift.y, 0));
    if (u_divider_px >= 0.0)
        colour = mix(colour, vec3(1.0), 0.85 * clamp(1.5 - abs(gl_FragCoord.x - u_divider_px), 0.0, 1.0));
    if (u_lens.z > 0.0) colour = mix(colour, vec3(1.0, 0.80, 0.47), clamp(2.0 - abs(beyond_px), 0.0, 1.0));
    out_colour = vec4(colour, 1.0);
}
