// shade/lobes.frag — style "lobes": the merged lobe of each footprint's normals.
//   Its direction east, north, up is red, green, blue; the more the normals differ, the greyer.

#include "shade/samples.glsl"
#include "light/lit.glsl"
#include "shade/tone.glsl"

vec3 ground_colour(Ground g, int sample_) { return 0.5 + 0.5 * merged_ground(g).normal; }

#define SKY_COLOUR vec3(0.5)
#define SHOWN srgb_encoded
#include "shade/pixel.glsl"
