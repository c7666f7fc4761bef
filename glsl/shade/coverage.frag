// shade/coverage.frag — the number of a pixel's samples that see the ground.

#include "shade/seen.glsl"

out uint out_samples;

void main() {
    out_samples = 0u;
    for (int i = 0; i < SAMPLES; i++) out_samples += is_sky(post_of_sample(i)) ? 0u : 1u;
}
