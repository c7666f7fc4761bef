// shade/visibility.frag — style "visibility": the visible share of the sky as blue, and of the sun as red and green.

#include "shade/samples.glsl"
#include "light/lit.glsl"
#include "shade/tone.glsl"

vec3 ground_colour(Ground g, int sample_) {
    Lit l = lit_ground(g);
    float sun = l.unshadowed > 0.0 ? min(l.sun / l.unshadowed, 1.0) : 0.0;
    return vec3(vec2(0.85 * sun), l.sky);
}

#define SKY_COLOUR vec3(0.0)
#define SHOWN srgb_encoded
#include "shade/pixel.glsl"
