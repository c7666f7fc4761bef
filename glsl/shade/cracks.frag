// shade/cracks.frag — style "cracks": patches do not agree on edges (OWN_EDGES in mesh/patch.tesc).
//   Pixels with a sample that looks through a crack are red. Other pixels have the colours of style "segments", paler.

#include "shade/drawn.glsl"

vec3 ground_colour(Ground g, int sample_) {
    Drawn d = drawn_at(sample_);
    vec3 tint = mix(viridis(d.segments_log2 / 5.0), vec3(1.0), 0.5);
    return tint * (0.40 + 0.75 * clay(g)) * (1.0 - 0.4 * d.border);
}

vec3 sky_colour(Ray ray) { return vec3(0.93); }

vec4 colour_of_pixel() {
    for (int i = 0; i < SAMPLES; i++)
        if (!is_sky(post_of_sample(i)) && drawn_at(i).px > 0.5) return vec4(1.0, 0.0, 0.0, 1.0);
    return vec4(pixel_colour(), 1.0);
}

#include "shade/pixel.glsl"
