// light/shown.glsl — from light to the picture: through the air, exposed, toned, dithered. All that light is compared with
// shares it.
// Provides land_colour(), sky_colour(), shown().

#include "light/air.glsl"
#include "shade/tone.glsl"

vec3 land_colour(Ground g, vec3 light, float distance_m) {
    return tone_mapped(u_exposure * hazed(light, -g.towards_eye, distance_m));
}

vec3 sky_colour(vec3 direction) { return tone_mapped(u_exposure * (sky_light(direction) + sun_disc(direction))); }

// Half a step of 8 bits, up or down, keeps the sky and smooth land from showing bands.
float dither() { return (hashed(ivec2(picture_px(FRAG_COORD))) - 0.5) / 255.0; }

vec4 shown(vec3 linear) { return vec4(srgb_encoded(linear) + dither(), 1.0); }
