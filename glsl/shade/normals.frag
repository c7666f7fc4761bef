// shade/normals.frag — style "normals": the normal of each pixel's footprint, x east, y north, z up,
//   as red, green, blue.

#include "shade/samples.glsl"

vec3 ground_colour(Ground g, int sample_) { return 0.5 + 0.5 * normal_of(g.fine.slope); }

vec3 sky_colour(vec3 direction) { return vec3(0.0); }

vec4 colour_of_pixel() { return vec4(pixel_colour(), 1.0); }

#include "shade/pixel.glsl"
