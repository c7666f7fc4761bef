// shade/direct.frag — style "direct": white ground in the light of the sun alone.

#include "shade/samples.glsl"
#include "light/lit.glsl"
#include "shade/tone.glsl"

vec3 ground_colour(Ground g, int sample_) { return tone_mapped(u_exposure * direct_light(lit_ground(g))); }

#define SKY_COLOUR vec3(0.0)
#define SHOWN srgb_encoded
#include "shade/pixel.glsl"
