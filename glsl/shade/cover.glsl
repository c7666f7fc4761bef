// shade/cover.glsl — what the ground is made of, from the map alone: how high it lies in the map's range, how steep it
// is, whether it is hollow or stands out; or, for its colour, from a picture of it. Colours are diffuse albedos.
// Provides Material, material_of(), WATER.

#include "shade/relief.glsl"
#include "shade/character.glsl"

struct Material {
    vec3 albedo;
    float roughness;  // 0 a mirror, 1 as dull as can be: its square is Beckmann's alpha
};

const Material SNOW = Material(vec3(0.84, 0.87, 0.91), 0.55), WATER = Material(vec3(0.006, 0.018, 0.026), 0.12);

// A program for one map is told what it can leave out: whether the land wears a picture, is green, is not green.
#ifndef PICTURED
uniform bool u_pictured;
#define PICTURED u_pictured
#define GREEN (greenness() > 0.0)
#define ARID (greenness() < 1.0)
#endif

layout(binding = 6) uniform sampler2D u_albedo;  // a picture of the ground, north up, over the whole map

Material mixed(Material a, Material b, float t) {
    return Material(mix(a.albedo, b.albedo, t), mix(a.roughness, b.roughness, t));
}

Material added(Material a, Material b, float weight) {
    return Material(a.albedo + weight * b.albedo, a.roughness + weight * b.roughness);
}

// Colours of the picture, multiplied by the share of the footprint that it covers; and that share.
vec4 picture_of(vec2 post, vec2 extent) {
    vec2 texels = extent * vec2(textureSize(u_albedo, 0)) / vec2(u_last_post + 1);
    return textureLod(u_albedo, (post + 0.5) / vec2(u_last_post + 1), log2(max(max(texels.x, texels.y), 1.0)));
}

float hashed(ivec2 at) {
    uint n = uint(at.x) * 0x9e3779b1u ^ uint(at.y) * 0x85ebca77u;
    n = (n ^ n >> 15) * 0x2c1b3c6du;
    n = (n ^ n >> 12) * 0x297a2d39u;
    return float(n >> 8) / 16777216.0;
}

// Value noise of mean 0, over a footprint. A mean over a box of w × h grains is best told from its middle by taking
// 1 / (1 + w²/7.4) / (1 + h²/7.4) of the value there (least squares); the Gaussian is as much for small boxes, and ends sooner.
float noise(vec2 post, float grain, vec2 extent) {
    vec2 wide = extent / grain;
    float seen = 1.03 * exp(-0.125 * dot(wide, wide)) - 0.03;  // comes to an end
    if (seen < 0.0) return 0.0;
    vec2 p = post / grain, t = fract(p);
    ivec2 at = ivec2(floor(p));
    t = t * t * (3.0 - 2.0 * t);
    float north = mix(hashed(at), hashed(at + ivec2(1, 0)), t.x);
    float south = mix(hashed(at + ivec2(0, 1)), hashed(at + ivec2(1, 1)), t.x);
    return (mix(north, south, t.y) - 0.5) * seen;
}

float patchiness(vec2 post, vec2 extent) {
    return 0.5 * noise(post, 41.0, extent) + 0.5 * noise(post, 11.3, extent) + 0.4 * noise(post, 3.7, extent) +
           0.3 * noise(post, 1.1, extent) + 0.2 * noise(post, 0.31, extent);
}

// Layers of rock that crop out at the same heights everywhere; too thin ones for the footprint fade, early: on cliffs the
// height of its middle is hardly known better.
float strata(float height, float footprint) {
    float sum = 0.0;
    for (float layers = 9.0; layers < 80.0; layers *= 2.7) sum += noise(vec2(height * layers, layers), 1.0, vec2(2.83 * footprint * layers, 0.0));
    return sum;
}

Material green_land(float zone, float steep, float patch_, float hollow) {
    vec3 valley = vec3(0.075, 0.095, 0.032), forest = vec3(0.030, 0.047, 0.020), meadow = vec3(0.105, 0.112, 0.042);
    vec3 heath = vec3(0.150, 0.125, 0.075), scree = vec3(0.215, 0.198, 0.178), rock = vec3(0.150, 0.139, 0.129);
    float wooded = smoothstep(0.02, 0.10, zone) * (1.0 - smoothstep(0.26, 0.36, zone)) * smoothstep(0.12, 0.40, steep + 0.5 * patch_);
    vec3 colour = mix(mix(valley, meadow, smoothstep(0.03, 0.20, zone)), forest, 0.85 * wooded);
    colour = mix(colour, heath, smoothstep(0.30, 0.44, zone));
    colour = mix(colour, scree, smoothstep(0.42, 0.60, zone));
    float bare = smoothstep(1.00, 1.55, steep * (1.0 + 0.5 * patch_) + 1.6 * zone - 0.3 * hollow);
    return mixed(Material(colour, 0.9), Material(rock * (1.0 + 0.5 * patch_), 0.7), bare);
}

vec3 arid_albedo(float zone, float steep, float patch_, float layer) {
    vec3 floor_ = vec3(0.200, 0.160, 0.105), upland = vec3(0.235, 0.185, 0.120);
    vec3 red = vec3(0.270, 0.135, 0.075), cream = vec3(0.400, 0.290, 0.190);
    vec3 flat_ = mix(floor_, upland, smoothstep(0.1, 0.7, zone)) * (1.0 + 0.2 * patch_);
    vec3 cliff = mix(red, cream, clamp(0.35 + 1.1 * layer + 0.15 * patch_, 0.0, 1.0));
    vec3 colour = mix(flat_, cliff, smoothstep(0.30, 0.80, steep));
    return mix(vec3(dot(colour, vec3(0.35, 0.45, 0.20))), colour, saturation());
}

#define AROUND_POSTS 6  // of the box around a post that its hollow is seen in, to each side

// How far the nearest post lies below the mean of a box around it, 1 for slopes of 45 degrees all around.
float hollow_of(vec2 post) {
    ivec2 at = ivec2(round(post));
    float mean_m = box_mean_m(max(at - AROUND_POSTS, 0), min(at + AROUND_POSTS, u_last_post) + 1);
    return clamp((mean_m - height_m(at)) / (0.5 * float(AROUND_POSTS) * min(u_spacing_m.x, u_spacing_m.y)), -1.0, 1.0);
}

// Standing water lies dead level, far and wide, in green land, and in no hollow of it, as the beds of valleys do; a map that
// is level everywhere is none.
float wetness(vec2 post, vec2 extent, Relief fine, float hollow) {
    if (!GREEN || u_rms_slope < 0.001) return 0.0;
    float around = length(rough_slope(post, max(vec2(16.0), extent)));
    return greenness() * (1.0 - smoothstep(0.0004, 0.0015, around + 0.5 * length(fine.slope) + abs(hollow)));
}

Material land_of(vec2 post, vec2 extent, Relief fine, float hollow) {
    float height = (fine.height_m - u_low_m) / u_span_m, steep = length(fine.slope);
    float patch_ = patchiness(post, extent);
    float zone = height + 0.10 * patch_ - 0.05 * hollow;
    float thickness = steep * max(extent.x * u_spacing_m.x, extent.y * u_spacing_m.y) / u_span_m;
    Material land = Material(vec3(0.0), 0.0);
    if (GREEN) land = added(land, green_land(zone, steep, patch_, hollow), greenness());
    if (ARID) {
        float layer = strata(height + 0.01 * patch_, thickness);
        land = added(land, Material(arid_albedo(zone, steep, patch_, layer), 0.85), 1.0 - greenness());
    }
    land.albedo *= 1.0 + 0.2 * patch_;
    float snowy = smoothstep(0.53, 0.68, zone + 0.06 * hollow) * (1.0 - smoothstep(0.85, 1.35, steep + 0.3 * patch_));
    return mixed(land, SNOW, snowy * snowiness());
}

// What a footprint is covered with; its extent, in posts, decides what fades.
Material material_of(vec2 post, vec2 extent, Relief fine) {
    vec4 picture = PICTURED ? picture_of(post, extent) : vec4(0.0);
    Material pictured = Material(picture.rgb / max(picture.a, 1e-6), 0.8);
    if (picture.a > 0.999) return pictured;
    float hollow = hollow_of(post) * smoothstep(0.7, 1.5, max(extent.x, extent.y));  // it has steps, from post to post
    Material land = mixed(land_of(post, extent, fine, hollow), WATER, wetness(post, extent, fine, hollow));
    return mixed(land, pictured, picture.a);
}
