// shade/places.frag — which place of the map a sample of each pixel sees: column and row, negative for the sky.

#include "shade/samples.glsl"

uniform int u_sample;

out vec2 out_post;

vec3 ground_colour(Ground g, int sample_) { return vec3(0.0); }

vec3 sky_colour(vec3 direction) { return vec3(0.0); }

void main() { out_post = post_of_sample(u_sample); }
