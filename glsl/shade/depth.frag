// shade/depth.frag — style "depth": white at the eye, half as bright where the view depth is a quarter of the map's
// diagonal, black infinitely far away.

#include "shade/samples.glsl"

vec3 ground_colour(Ground g, int sample_) {
    float half_m = 0.25 * length(vec2(u_last_post) * u_spacing_m);
    return vec3(half_m / (half_m + max(dot(g.from_eye_m, u_forward.xyz), 0.0)));
}

vec3 sky_colour(vec3 direction) { return vec3(0.0); }

vec4 colour_of_pixel() { return vec4(pixel_colour(), 1.0); }

#include "shade/pixel.glsl"
