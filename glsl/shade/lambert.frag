// shade/lambert.frag — style "lambert": one normal for each pixel, one light, no shadows.
//   Benchmarks compare the shading times of other styles with this style.

#include "shade/samples.glsl"
#include "shade/tone.glsl"

uniform vec3 u_sun;

vec3 ground_colour(Ground g, int sample_) { return vec3(0.10 + 0.60 * max(dot(normal_of(g.fine.slope), u_sun), 0.0)); }

#define SKY_COLOUR vec3(0.35, 0.50, 0.75)
#define SHOWN srgb_encoded
#include "shade/pixel.glsl"
