// shade/into.frag — the finished picture with the depth of what it shows, for a framebuffer of the caller.
//   A place at the view depth z has the clip coordinates  z_clip = a z + b,  w_clip = c z + d  of the caller's
//   projection. Its depth there is z_clip / w_clip, mapped from −1..1 to 0..1 if the caller's depth runs so.
//   Land beyond the caller's planes is drawn at them: nothing of the map is cut off.

layout(binding = 0) uniform sampler2D u_picture;
layout(binding = 1) uniform sampler2D u_facts;  // shade/facts.frag, part 0

uniform ivec2 u_corner;  // lower left pixel of the viewport
uniform vec4 u_clip;     // a, b, c, d
uniform bool u_zero_to_one;
uniform bool u_has_sky;  // else pixels of the sky keep what the caller drew
uniform float u_far;     // the caller's depth of the sky

out vec4 out_colour;

const float LEAST = 1.0 / 8388608.0;  // a little in front of the far plane, for comparisons with "<"

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy) - u_corner;
    float z_m = texelFetch(u_facts, at, 0).w;
    out_colour = texelFetch(u_picture, at, 0);
    bool is_sky = isinf(z_m);
    if (is_sky && !u_has_sky) discard;
    vec2 clip = u_clip.xz * z_m + u_clip.yw;
    float depth = is_sky ? u_far : clip.x / clip.y;
    if (!is_sky && !u_zero_to_one) depth = 0.5 * depth + 0.5;
    gl_FragDepth = clamp(depth, LEAST, 1.0 - LEAST);
}
