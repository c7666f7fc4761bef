// shade/normals.frag — style "normals": the normal of each pixel's footprint, x east, y north, z up, as red, green, blue.

#include "shade/samples.glsl"

out vec4 out_colour;

vec3 ground_colour(Ground g, int sample_) { return 0.5 + 0.5 * normal_of(g.fine.slope); }

vec3 sky_colour(vec3 direction) { return vec3(0.0); }

void main() { out_colour = vec4(pixel_colour(), 1.0); }
