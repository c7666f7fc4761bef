// shade/wireframe.frag — style "wireframe": the drawn triangles, on a plain shade.

#include "shade/drawn.glsl"

vec3 ground_colour(Ground g, int sample_) {
    Drawn d = drawn_at(sample_);
    vec3 paper = vec3(0.93, 0.92, 0.89) * (0.35 + 0.70 * clay(g));
    return mix(paper, vec3(0.05, 0.12, 0.25), 0.85 * d.edge);
}

#define SKY_COLOUR vec3(0.97)
#include "shade/pixel.glsl"
