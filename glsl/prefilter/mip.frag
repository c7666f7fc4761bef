// prefilter/mip.frag — mipmaps of normals, made unit length again after lookup, and of the shadow: what most games do.

#include "prefilter/frame.glsl"

Lit lit_by_rival(Ground g) {
    Mips m = mips_over(g, 1.0);
    return lit_as_one(g, normalize(m.normal), cover_sharpness(g), m.sun);
}

vec4 colour_of_pixel() { return shown(pixel_colour()); }

#include "shade/pixel.glsl"
