// light/dome.glsl — the sky in any direction: drawn behind the land, mirrored by water, and scattered by haze.
//   Columns go south, west, north, east: north is in the middle.
//   Rows go from the nadir, v = −1, to the zenith, v = 1, at elevations of 90° · v·|v|:
//   they are denser near the horizon.
// Provides sky_light(), sun_disc(), sky_blurred().   Python twin: light.sky.dome

#include "light/lights.glsl"

layout(binding = 5) uniform sampler2D u_dome;

vec2 dome_place(vec3 direction) {
    float elevation = asin(clamp(direction.z, -1.0, 1.0)) / (0.5 * PI);
    float azimuth = atan(direction.x, direction.y) / (2.0 * PI);
    return vec2(0.5 + azimuth, 0.5 + 0.5 * sign(elevation) * sqrt(abs(elevation)));
}

vec3 sky_light(vec3 direction) { return textureLod(u_dome, dome_place(direction), 0.0).rgb; }

// The sky, blurred by a lobe of this sharpness. As an approximation, we take the mipmap level whose texels are as wide
// as the lobe.
vec3 sky_blurred(vec3 direction, float sharpness) {
    float texel = 2.0 * PI / float(textureSize(u_dome, 0).x);
    return textureLod(u_dome, dome_place(direction), log2(max(inversesqrt(sharpness) / texel, 1.0))).rgb;
}

vec3 sun_disc(vec3 direction) { return direction.z < 0.0 ? vec3(0.0) : sg_value(light_lobe(u_sun), direction); }
