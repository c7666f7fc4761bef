// shade/promise.frag — style "promise": the certified bound of each patch in pixels. Black is 0, pale yellow the end of
// the scale; bounds above the scale are cyan; patches without a bound are grey.

#include "shade/drawn.glsl"

vec3 ground_colour(Ground g, int sample_) {
    Drawn d = drawn_at(sample_);
    vec3 tint = d.px < 0.0 ? vec3(0.5) : error_colour(d.px);
    return tint * (0.65 + 0.35 * clay(g)) * (1.0 - 0.5 * d.border);
}

#define SKY_COLOUR vec3(0.60)
#include "shade/pixel.glsl"
