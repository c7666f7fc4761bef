// shade/shaded.frag — style "shaded": land and water in the light of sun and sky, seen through the air.

#include "shade/samples.glsl"
#include "light/water.glsl"
#include "light/shown.glsl"
#include "light/around.glsl"

#ifndef WATER_LEVEL
#define WATER_LEVEL 1  // 0 without water: its code is then left out
#endif

vec3 ground_colour(Ground g, int sample_) {
    Lit l = lit_ground(g);
    vec3 light = outgoing_light(g.towards_eye, l);
    float distance_m = g.distance_m;
    if (WATER_LEVEL == 1 && is_under_water(g)) light = water_light(g, l, light, distance_m);
    return land_colour(g, light, distance_m);
}

vec4 colour_of_pixel() { return shown(pixel_colour()); }

#include "shade/pixel.glsl"
