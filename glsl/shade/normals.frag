// shade/normals.frag — style "normals": the normal of each pixel's footprint, x east, y north, z up,
//   as red, green, blue.
//   With EXACT, for pictures of floats: the unit normal itself; alpha is 0 in the sky, else 1.

#include "shade/samples.glsl"

#ifdef EXACT
vec3 ground_colour(Ground g, int sample_) { return normal_of(g.fine.slope); }

vec4 colour_of_pixel() {
    vec3 sum = pixel_colour();
    return ground_share() > 0.0 ? vec4(normalize(sum), 1.0) : vec4(0.0);
}

vec3 sky_colour(Ray ray) { return vec3(0.0); }
#else
vec3 ground_colour(Ground g, int sample_) { return 0.5 + 0.5 * normal_of(g.fine.slope); }
#define SKY_COLOUR vec3(0.0)
#endif

#include "shade/pixel.glsl"
