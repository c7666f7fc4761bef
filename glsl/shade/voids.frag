// shade/voids.frag — style "voids": clay, and orange where the map has no data:
//   the surface there is filled from the rim.

#include "shade/drawn.glsl"
#include "shade/marks.glsl"

vec3 ground_colour(Ground g, int sample_) {
    float filled = MARKED ? marked_at(g.post).x : 0.0;
    return mix(vec3(0.85), vec3(1.0, 0.45, 0.05), filled) * clay(g);
}

#define SKY_COLOUR vec3(0.93)
#include "shade/pixel.glsl"
