// prefilter/point.frag — no prefilter: the normal and the shadow at the footprint's middle.

#include "../benchmarks/glsl/prefilter/frame.glsl"

Lit lit_by_baseline(Ground g) {
    vec4 at = textureLod(u_normals, g.post / vec2(u_last_post), 0.0);
    return lit_as_one(g, normalize(at.xyz), cover_sharpness(g), at.w);
}

vec4 colour_of_pixel() { return shown(pixel_colour()); }

#include "shade/pixel.glsl"
