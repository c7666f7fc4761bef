// shade/ambient.frag — style "ambient": white ground, lit by the sky and by the land around it, without the sun.

#include "shade/samples.glsl"
#include "light/lit.glsl"
#include "shade/tone.glsl"

vec3 ground_colour(Ground g, int sample_) {
    return tone_mapped(2.0 * u_exposure * lit_ground(g).ambient);
}

vec3 sky_colour(vec3 direction) { return vec3(0.0); }

vec4 colour_of_pixel() { return vec4(srgb_encoded(pixel_colour()), 1.0); }

#include "shade/pixel.glsl"
