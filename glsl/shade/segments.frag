// shade/segments.frag — style "segments": the number T of segments along a patch's side,
//   from violet (one quad) over green to yellow (32 × 32). Borders of patches are dark.

#include "shade/drawn.glsl"

vec3 ground_colour(Ground g, int sample_) {
    Drawn d = drawn_at(sample_);
    vec3 tint = mix(viridis(d.segments_log2 / 5.0), vec3(1.0), 0.1);
    return tint * (0.40 + 0.75 * clay(g)) * (1.0 - 0.65 * d.border);
}

#define SKY_COLOUR vec3(0.93)
#include "shade/pixel.glsl"
