// shade/shaded.frag — style "shaded": land and water in the light of sun and sky, seen through the air.

#include "shade/samples.glsl"
#include "light/water.glsl"
#include "light/air.glsl"
#include "shade/tone.glsl"

#ifndef WATER_LEVEL
#define WATER_LEVEL 1  // 0 where there is none: what is not asked for is not paid for
#endif

out vec4 out_colour;

vec3 surface_light(Ground g, out float distance_m) {
    Lit l = lit_ground(g);
    vec3 light = outgoing_light(g, l);
    distance_m = g.distance_m;
    if (WATER_LEVEL == 1 && is_under_water(g)) light = water_light(g, l, light, distance_m);
    return light;
}

vec3 ground_colour(Ground g, int sample_) {
    float distance_m;
    vec3 light = surface_light(g, distance_m);
    return tone_mapped(u_exposure * hazed(light, -g.towards_eye, distance_m));
}

vec3 sky_colour(vec3 direction) { return tone_mapped(u_exposure * (sky_light(direction) + sun_disc(direction))); }

// Half a step of 8 bits, up or down, keeps the sky from showing bands.
float dither() { return (hashed(ivec2(picture_px(gl_FragCoord))) - 0.5) / 255.0; }

void main() { out_colour = vec4(srgb_encoded(pixel_colour()) + dither(), 1.0); }
