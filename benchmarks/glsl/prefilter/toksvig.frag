// prefilter/toksvig.frag — mipmaps of normals; a mean normal N shorter than 1 widens the highlight:
//   s' = s |N| / (|N| + s (1 − |N|)), s the power of the highlight   (Toksvig 2005, "Mipmapping normal maps")
// The power of a cosine is the sharpness of its lobe.

#include "../benchmarks/glsl/prefilter/frame.glsl"

Lit lit_by_baseline(Ground g) {
    Mips m = mips_over(g, 1.0);
    float N = min(length(m.normal), 1.0), s = cover_sharpness(g);
    return lit_as_one(g, normalize(m.normal), s * N / (N + s * (1.0 - N)), m.sun);
}

vec4 colour_of_pixel() { return shown(pixel_colour()); }

#include "shade/pixel.glsl"
