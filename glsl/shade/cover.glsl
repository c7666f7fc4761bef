// shade/cover.glsl — what the ground is made of, from the map alone: how high it lies in the map's range, how steep it
// is, whether it is hollow or stands out. Colours are diffuse albedos.
// Provides albedo_of().

#include "shade/footprint.glsl"

float hashed(ivec2 at) {
    uint n = uint(at.x) * 0x9e3779b1u ^ uint(at.y) * 0x85ebca77u;
    n = (n ^ n >> 15) * 0x2c1b3c6du;
    n = (n ^ n >> 12) * 0x297a2d39u;
    return float(n >> 8) / 16777216.0;
}

// Value noise of mean 0 that fades where the footprint grows past its grain.
float noise(vec2 post, float grain, vec2 extent) {
    vec2 p = post / grain, t = fract(p);
    ivec2 at = ivec2(floor(p));
    t = t * t * (3.0 - 2.0 * t);
    float north = mix(hashed(at), hashed(at + ivec2(1, 0)), t.x);
    float south = mix(hashed(at + ivec2(0, 1)), hashed(at + ivec2(1, 1)), t.x);
    return (mix(north, south, t.y) - 0.5) * exp(-pow(max(extent.x, extent.y) / grain, 2.0));
}

float patchiness(vec2 post, vec2 extent) {
    return noise(post, 37.0, extent) + 0.5 * noise(post, 11.0, extent) + 0.3 * noise(post, 3.1, extent) +
           0.2 * noise(post, 0.7, extent);
}

vec3 albedo_of(Ground g) {
    float height = (g.fine.height_m - u_low_m) / u_span_m;
    float steep = length(g.fine.slope), patch_ = patchiness(g.post, g.extent);
    float hollow = (g.broad.height_m - g.fine.height_m) / (0.1 * BROAD_POSTS * max(u_spacing_m.x, u_spacing_m.y));

    vec3 valley = vec3(0.085, 0.105, 0.045), meadow = vec3(0.135, 0.130, 0.065), heath = vec3(0.165, 0.140, 0.095);
    vec3 rock = vec3(0.205, 0.190, 0.175), scree = vec3(0.27, 0.25, 0.225), snow = vec3(0.86, 0.89, 0.93);

    float zone = height + 0.10 * patch_ - 0.06 * clamp(hollow, -1.0, 1.0);
    vec3 colour = mix(valley, meadow, smoothstep(0.08, 0.32, zone));
    colour = mix(colour, heath, smoothstep(0.30, 0.52, zone));
    colour = mix(colour, scree, smoothstep(0.48, 0.68, zone));
    colour = mix(colour, rock * (1.0 + 0.35 * patch_), smoothstep(0.42, 0.85, steep * (1.0 + 0.4 * patch_)));
    float snowy = smoothstep(0.62, 0.78, zone + 0.05 * hollow) * (1.0 - smoothstep(0.75, 1.25, steep));
    return mix(colour * (1.0 + 0.25 * patch_), snow, snowy);
}
