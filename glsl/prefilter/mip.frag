// prefilter/mip.frag — mipmaps of normals, made unit length again after lookup, and of the shadow: what most games do.

#include "prefilter/frame.glsl"

out vec4 out_colour;

Lit lit_by_rival(Ground g) {
    Mips m = mips_over(g, 1.0);
    return lit_as_one(g, normalize(m.normal), cover_sharpness(g), m.sun);
}

void main() { out_colour = shown(pixel_colour()); }
