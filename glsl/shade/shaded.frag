// shade/shaded.frag — style "shaded": ground in the light of sun and sky, seen through haze.

#include "shade/samples.glsl"
#include "shade/cover.glsl"
#include "shade/sky.glsl"
#include "shade/tone.glsl"

#define EXPOSURE 0.62

layout(binding = 3) uniform sampler2D u_sun_visibility;

out vec4 out_colour;

float sun_visibility(Ground g) {
    float level = log2(max(sqrt(g.extent.x * g.extent.y), 1.0));
    return textureLod(u_sun_visibility, (g.post + 0.5) / vec2(u_last_post + 1), level).x;
}

// How far the ground lies below the mean of a box around it, 1 for slopes of 45 degrees all around.
float hollow_of(Ground g, float posts) {
    float reach_m = 0.25 * posts * min(u_spacing_m.x, u_spacing_m.y);
    return (mean_height_m(g.post, posts, max(g.extent.x, g.extent.y) < 1.0) - g.fine.height_m) / reach_m;
}

vec3 ground_light(Ground g) {
    float close = hollow_of(g, 12.0), wide = hollow_of(g, 90.0);
    vec3 normal = normal_of(g.fine.slope);
    float sun = max(dot(normal, u_sun), 0.0) * sun_visibility(g);
    float openness = exp(-0.8 * max(close, 0.0) - 1.2 * max(wide, 0.0));
    vec3 bounce = 0.12 * sun_light() * max(u_sun.z, 0.15) * (1.2 - normal.z) * vec3(0.26, 0.22, 0.16);
    return albedo_of(g, close) * (sun_light() * sun + (skylight_on(normal) + bounce) * openness);
}

// Water mirrors the sky, more so at low angles (Schlick 1994), over a dark floor.
vec3 water_light(Ground g) {
    vec3 mirrored = reflect(-g.towards_eye, vec3(0.0, 0.0, 1.0));
    float fresnel = 0.02 + 0.98 * pow(1.0 - clamp(g.towards_eye.z, 0.0, 1.0), 5.0);
    vec3 floor_ = vec3(0.010, 0.028, 0.040) * (sun_light() * max(u_sun.z, 0.0) * sun_visibility(g) + skylight_on(vec3(0.0, 0.0, 1.0)));
    return mix(floor_, air_light(mirrored), fresnel);
}

vec3 surface_light(Ground g) {
    float wet = wetness(g);
    vec3 light = vec3(0.0);
    if (wet < 1.0) light += (1.0 - wet) * ground_light(g);
    if (wet > 0.0) light += wet * water_light(g);
    return light;
}

vec3 ground_colour(Ground g, int sample_) { return tone_mapped(EXPOSURE * hazed(surface_light(g), -g.towards_eye, g.distance_m)); }

vec3 sky_colour(vec3 direction) { return tone_mapped(EXPOSURE * sky_light(direction)); }

// Half a step of 8 bits, up or down, keeps the sky from showing bands.
float dither() { return (hashed(ivec2(picture_px(gl_FragCoord))) - 0.5) / 255.0; }

void main() { out_colour = vec4(srgb_encoded(pixel_colour()) + dither(), 1.0); }
