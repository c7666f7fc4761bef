// prefilter/mip.frag — mipmaps of normals, normalised after the lookup, and of the shadow, as in most games.

#include "../benchmarks/glsl/prefilter/frame.glsl"

Lit lit_by_baseline(Ground g) {
    Mips m = mips_over(g, 1.0);
    return lit_as_one(g, normalize(m.normal), cover_sharpness(g), m.sun);
}

vec4 colour_of_pixel() { return shown(pixel_colour()); }

#include "shade/pixel.glsl"
