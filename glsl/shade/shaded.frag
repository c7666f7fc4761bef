// shade/shaded.frag — style "shaded": ground in the light of sun and sky, seen through haze.

#include "shade/samples.glsl"
#include "shade/cover.glsl"
#include "shade/sky.glsl"
#include "shade/tone.glsl"

out vec4 out_colour;

// The part of the sky that hollow ground does not see, from how far it lies below the mean around it.
float openness(Ground g) {
    float reach_m = BROAD_POSTS * 0.25 * min(u_spacing_m.x, u_spacing_m.y);
    float wide = (mean_height_m(g.post, 8.0 * BROAD_POSTS) - g.fine.height_m) / (8.0 * reach_m);
    float close = (g.broad.height_m - g.fine.height_m) / reach_m;
    return exp(-0.9 * max(close, 0.0)) * exp(-1.1 * max(wide, 0.0));
}

vec3 ground_light(Ground g) {
    vec3 normal = normal_of(g.fine.slope);
    float sun = max(dot(normal, u_sun), 0.0);
    float up = 0.5 + 0.5 * normal.z;
    vec3 sky = mix(horizon_light(), zenith_light(), 0.55) * up * openness(g);
    vec3 bounce = 0.10 * sun_light() * max(u_sun.z, 0.0) * (1.0 - 0.6 * normal.z) * vec3(0.30, 0.26, 0.20);
    return albedo_of(g) * (sun_light() * sun + 0.9 * sky + bounce);
}

vec3 ground_colour(Ground g) { return tone_mapped(hazed(ground_light(g), -g.towards_eye, g.distance_m)); }

vec3 sky_colour(vec3 direction) { return tone_mapped(sky_light(direction)); }

void main() { out_colour = vec4(srgb_encoded(pixel_colour()), 1.0); }
