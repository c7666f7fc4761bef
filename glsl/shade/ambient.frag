// shade/ambient.frag — style "ambient": white ground, lit by the sky and by the land around it, without the sun.

#include "shade/samples.glsl"
#include "light/lit.glsl"
#include "shade/tone.glsl"

vec3 ground_colour(Ground g, int sample_) { return tone_mapped(2.0 * u_exposure * lit_ground(g).ambient); }

#define SKY_COLOUR vec3(0.0)
#define SHOWN srgb_encoded
#include "shade/pixel.glsl"
