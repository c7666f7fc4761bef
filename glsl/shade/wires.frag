// shade/wires.frag — the edges of triangles; they are blended over a picture in any style.

#include "shade/drawn.glsl"

out vec4 out_colour;

vec3 ground_colour(Ground g, int sample_) { return vec3(0.0); }

vec3 sky_colour(Ray ray) { return vec3(0.0); }

void main() {
    float edge = 0.0;
    for (int i = 0; i < SAMPLES; i++) edge += is_sky(post_of_sample(i)) ? 0.0 : drawn_at(i).edge;
    out_colour = vec4(1.0, 1.0, 1.0, 0.55 * edge / float(SAMPLES));
}
