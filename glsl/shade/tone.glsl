// shade/tone.glsl — from light to the screen: tone mapping, and the sRGB curve (IEC 61966-2-1).
// With EXACT, for pictures of floats, both leave the light as it is.
// Provides tone_mapped(), srgb_encoded().   Python twin: image.srgb_from_linear

#include "blocks/colour.glsl"

#ifdef EXACT
vec3 tone_mapped(vec3 light) { return light; }
vec3 srgb_encoded(vec3 linear) { return linear; }
#else

#define WHITE 2.2  // the luminance that is displayed as white

// Reinhard et al. 2002, "Photographic tone reproduction for digital images", equation 4, on the luminance; blended with
// the same curve on each channel, so that very bright colours become paler.
vec3 tone_mapped(vec3 light) {
    float luminance = dot(light, LUMINANCE);
    float shown = luminance * (1.0 + luminance / (WHITE * WHITE)) / (1.0 + luminance);
    vec3 by_luminance = light * (shown / max(luminance, 1e-6));
    vec3 by_channel = light * (1.0 + light / (WHITE * WHITE)) / (1.0 + light);
    return clamp(mix(by_luminance, by_channel, 0.35), 0.0, 1.0);
}

vec3 srgb_encoded(vec3 linear) {
    vec3 c = clamp(linear, 0.0, 1.0);
    return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, greaterThan(c, vec3(0.0031308)));
}

#endif
