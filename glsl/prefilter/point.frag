// prefilter/point.frag — no prefilter: the normal and the shadow at the footprint's middle.

#include "prefilter/frame.glsl"

out vec4 out_colour;

Lit lit_by_rival(Ground g) {
    vec4 at = textureLod(u_normals, g.post / vec2(u_last_post), 0.0);
    return lit_as_one(g, normalize(at.xyz), cover_sharpness(g), at.w);
}

void main() { out_colour = shown(pixel_colour()); }
