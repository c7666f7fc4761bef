// light/lights.glsl — all lights of the map: the sun, the sky's lobes, the surrounding land.
//   For each lobe of sharpness κ the block also holds the length of its mean vector, coth κ − 1/κ, and the integral of
//   e^(κ (ω·axis − 1)). Where land hides a lobe of the sky, the land's light replaces it: amplitude `hidden`.
// Provides u_sun, u_sky[], u_around, light_lobe(), sky_through().
// Python twins: light.gaussians.LOBE, light.gaussians.LIGHTS

#include "light/sg.glsl"

#define SKY_LOBES 9

struct Light {
    vec3 axis;
    float sharpness;
    vec3 amplitude;
    float mean_length;
    vec3 hidden;
    float integral;
};

layout(std140, binding = 2) uniform Lights {
    Light u_sun;
    Light u_sky[SKY_LOBES];
    vec3 u_around;   // radiance of the surrounding land, from all directions below the horizon
    float u_exposure;
    float u_haze_m;  // distance over which haze absorbs all but 1/e of the light
    float u_water_m; // height of standing water above the base
    vec2 u_pad;
};

Lobe light_lobe(Light l) { return Lobe(l.axis, l.sharpness, l.amplitude); }

// The light of a lobe of the sky. A share of it is visible; land is in front of the rest.
vec3 sky_through(Light l, float visible) { return mix(l.hidden, l.amplitude, visible); }
