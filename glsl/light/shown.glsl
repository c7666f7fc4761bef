// light/shown.glsl — from light to the picture: air, exposure, tone mapping, dithering.
//   The truth and the other prefilters use it, too.
// Provides land_colour(), sky_colour(), shown().

#include "light/air.glsl"
#include "shade/tone.glsl"

vec3 land_colour(Ground g, vec3 light, float distance_m) {
    return tone_mapped(u_exposure * hazed(light, -g.towards_eye, distance_m));
}

#if EDGE == 0
vec3 sky_colour(Ray ray) { return tone_mapped(u_exposure * (sky_light(ray.along) + sun_disc(ray.along))); }
#endif

// Dither by up to half a step of 8 bits, so that the sky and smooth land show no bands.
float dither() { return (hashed(ivec2(picture_px(FRAG_COORD))) - 0.5) / 255.0; }

#ifdef EXACT
vec4 shown(vec3 linear) { return vec4(linear, 1.0); }
#else
vec4 shown(vec3 linear) { return vec4(srgb_encoded(linear) + dither(), 1.0); }
#endif
