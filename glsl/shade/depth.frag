// shade/depth.frag — style "depth": white at the eye, half as bright where the view depth is a quarter of the map's
// diagonal, black infinitely far away.
//   With EXACT, for pictures of floats: the mean view depth of the samples on the ground, in metres.
//   In the sky it is infinite, and alpha is 0.

#include "shade/samples.glsl"

float depth_of_ground_m(Ground g) { return max(dot(g.from_eye_m, u_forward.xyz), 0.0); }

#ifdef EXACT
uniform float u_exaggeration;

vec3 ground_colour(Ground g, int sample_) { return vec3(u_exaggeration * depth_of_ground_m(g)); }

vec4 colour_of_pixel() {
    vec3 sum = pixel_colour();
    return ground_share() > 0.0 ? vec4(sum / ground_share(), 1.0) : vec4(vec3(1.0 / 0.0), 0.0);
}

vec3 sky_colour(Ray ray) { return vec3(0.0); }
#else
vec3 ground_colour(Ground g, int sample_) {
    float half_m = 0.25 * length(vec2(u_last_post) * u_spacing_m);
    return vec3(half_m / (half_m + depth_of_ground_m(g)));
}
#define SKY_COLOUR vec3(0.0)
#endif

#include "shade/pixel.glsl"
