// shade/coverage.frag — how many of a pixel's samples see the ground.

#include "shade/samples.glsl"

out uint out_samples;

vec3 ground_colour(Ground g, int sample_) { return vec3(0.0); }

vec3 sky_colour(vec3 direction) { return vec3(0.0); }

void main() {
    out_samples = 0u;
    for (int i = 0; i < SAMPLES; i++) out_samples += is_sky(post_of_sample(i)) ? 0u : 1u;
}
