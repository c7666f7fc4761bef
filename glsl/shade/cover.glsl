// shade/cover.glsl — the material of the ground, from the map alone: height, slope, water;
//   or its colour from a picture of the ground. Colours are diffuse albedos.
// Provides Material, material_of(), IS_DIAGRAM.

#include "shade/relief.glsl"
#include "shade/climate.glsl"
#include "shade/marks.glsl"

struct Material {
    vec3 albedo;
    float roughness;  // 0 for a mirror, 1 for fully matt; its square is Beckmann's alpha
};

const Material SNOW = Material(vec3(0.84, 0.87, 0.91), 0.55), WET_GROUND = Material(vec3(0.006, 0.018, 0.026), 0.12);
const Material FILLED = Material(vec3(0.20, 0.20, 0.21), 0.95);  // ground without data

// Looks: light.climate.LOOKS has their names.
#define NATURAL 0
#define EARTH 1
#define GREY 2
#define TINT 3
#define RAMP 4
#define IS_DIAGRAM (LOOK == GREY || LOOK == RAMP)  // water of the map then has the colour of land

// Macros for a program that serves one map, and leaves out all other code: whether a picture covers the land, the look
// of the land, whether any land is not fully dry (GREEN), whether any land is dry at all (ARID).
#ifndef PICTURED
uniform bool u_pictured;
uniform int u_look;
#define PICTURED u_pictured
#define LOOK u_look
#define GREEN true
#define ARID true
#endif

layout(binding = 6) uniform sampler2D u_albedo;  // a picture of the ground, north up, over the whole map

Material mixed(Material a, Material b, float t) {
    return Material(mix(a.albedo, b.albedo, t), mix(a.roughness, b.roughness, t));
}

// xyz: the picture's colour times the share of the footprint that the picture covers; w: that share.
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

// Value noise of mean 0 around a place in a cell of the lattice, and its slope in cells.
vec3 bump(ivec2 at, vec2 t) {
    vec2 u = t * t * t * (t * (t * 6.0 - 15.0) + 10.0), du = 30.0 * t * t * (t * (t - 2.0) + 1.0);
    float a = hashed(at);
    float b = hashed(at + ivec2(1, 0));
    float c = hashed(at + ivec2(0, 1));
    float d = hashed(at + 1);
    float twist = a - b - c + d;
    return vec3(du * (vec2(b - a, c - a) + twist * u.yx), a + (b - a) * u.x + (c - a) * u.y + twist * u.x * u.y - 0.5);
}

// The share of value noise that is seen in a footprint of w × h grains. The best estimate (least squares) of the mean
// over it is the value at its centre times 1 / (1 + w²/7.4) / (1 + h²/7.4). The Gaussian used here is nearly equal for
// small footprints, and reaches 0.
float seen_noise(vec2 grains) { return max(1.03 * exp(-0.125 * dot(grains, grains)) - 0.03, 0.0); }

// Value noise with mean 0, averaged over a footprint.
float noise(vec2 post, float grain, vec2 extent) {
    float seen = seen_noise(extent / grain);
    if (seen <= 0.0) return 0.0;
    vec2 p = post / grain;
    return bump(ivec2(floor(p)), fract(p)).z * seen;
}

float patchiness(vec2 post, vec2 extent) {
    return 0.5 * noise(post, 41.0, extent) + 0.5 * noise(post, 11.3, extent) + 0.4 * noise(post, 3.7, extent) +
           0.3 * noise(post, 1.1, extent) + 0.2 * noise(post, 0.31, extent);
}

// Layers of rock at the same heights everywhere. Layers that are thin compared with the footprint fade early, because
// the height of a footprint's centre is not accurate on cliffs.
float strata(float up_m, float footprint_m) {
    float sum = 0.0;
    for (float thick_m = 145.0; thick_m > 2.0; thick_m /= 2.7)
        sum += noise(vec2(up_m / thick_m, thick_m), 1.0, vec2(2.83 * footprint_m / thick_m, 0.0))
            * min(1.0, 0.5 + thick_m / 40.0);
    return sum;
}

Material green_land(float zone, float steep, float patch_) {
    vec3 valley = vec3(0.075, 0.095, 0.032), forest = vec3(0.030, 0.047, 0.020), meadow = vec3(0.105, 0.112, 0.042);
    vec3 heath = vec3(0.150, 0.125, 0.075), scree = vec3(0.215, 0.198, 0.178), rock = vec3(0.150, 0.139, 0.129);
    float wooded = smoothstep(0.01, 0.08, zone) * (1.0 - smoothstep(0.26, 0.36, zone))
        * smoothstep(0.12, 0.40, steep + 0.5 * patch_);
    vec3 colour = mix(mix(valley, meadow, smoothstep(0.03, 0.20, zone)), forest, 0.85 * wooded);
    colour = mix(colour, heath, smoothstep(0.30, 0.44, zone));
    colour = mix(colour, scree, smoothstep(0.42, 0.60, zone));
    float bare = smoothstep(1.00, 1.55, steep * (1.0 + 0.5 * patch_) + 1.6 * zone);
    return mixed(Material(colour, 0.9), Material(rock * (1.0 + 0.5 * patch_), 0.7), bare);
}

vec3 arid_albedo(float up_m, float steep, float patch_, float layer) {
    vec3 floor_ = vec3(0.200, 0.160, 0.105), upland = vec3(0.235, 0.185, 0.120);
    vec3 red = vec3(0.270, 0.135, 0.075), cream = vec3(0.400, 0.290, 0.190);
    vec3 flat_ = mix(floor_, upland, smoothstep(800.0, 1800.0, up_m)) * (1.0 + 0.2 * patch_);
    vec3 cliff = mix(red, cream, clamp(0.35 + 1.1 * layer + 0.15 * patch_, 0.0, 1.0));
    return mix(flat_, cliff, smoothstep(0.30, 0.80, steep));
}

// Land without a climate: grass on level ground, then soil, and rock on steep slopes.
Material earth_land(float steep, float patch_) {
    vec3 grass = vec3(0.118, 0.122, 0.066), soil = vec3(0.165, 0.140, 0.102), rock = vec3(0.200, 0.188, 0.172);
    vec3 colour = mix(grass, soil, smoothstep(0.15, 0.55, steep * (1.0 + 0.5 * patch_)));
    float bare = smoothstep(0.55, 1.0, steep * (1.0 + 0.5 * patch_));
    return mixed(Material(colour, 0.9), Material(rock * (1.0 + 0.3 * patch_), 0.75), bare);
}

// How many times steeper the relief is drawn than it is: the ground's cover follows true slopes.
uniform float u_exaggeration;

// Land of a climate: valleys, woods, meadows, scree, rock and snow, one above the other;
// in a dry climate sand and layers of rock.
Material natural_land(vec2 post, vec2 extent, Relief fine) {
    Climate climate = climate_at(post);
    float up_m = fine.height_m + u_base_m;
    float steep = length(fine.slope) / u_exaggeration;
    float patch_ = patchiness(post, extent);
    float zone = zone_of(up_m, climate) + 0.10 * patch_;
    Material land = GREEN ? green_land(zone, steep, patch_) : FILLED;
    if (ARID) {
        float thickness_m = length(fine.slope) * max(extent.x * u_spacing_m.x, extent.y * u_spacing_m.y);
        float layer = strata(up_m + 10.0 * patch_, thickness_m);
        land = mixed(land, Material(arid_albedo(up_m, steep, patch_, layer), 0.85), climate.dryness);
    }
    land.albedo *= 1.0 + 0.2 * patch_;
    float snowy = smoothstep(SNOW_STAYS - 0.07, SNOW_STAYS + 0.08, zone)
        * (1.0 - smoothstep(0.85, 1.35, steep + 0.3 * patch_));
    return mixed(land, SNOW, snowy);
}

vec3 between_stops(vec4 stops[10], float v) {  // xyz: a colour; w: its position
    for (int i = 1; i < 10; i++)
        if (v < stops[i].w)
            return mix(stops[i - 1].rgb, stops[i].rgb,
                clamp((v - stops[i - 1].w) / (stops[i].w - stops[i - 1].w), 0.0, 1.0));
    return stops[9].rgb;
}

// Hypsometric tints: the colours of an atlas, at metres above the sea
// (after Imhof 1982, "Cartographic relief presentation").
const vec4 TINTS[10] = vec4[10](
    vec4(0.02, 0.05, 0.12, -6000.0), vec4(0.06, 0.14, 0.25, -1000.0), vec4(0.17, 0.29, 0.36, -1.0),
    vec4(0.10, 0.17, 0.07, 0.0),
    vec4(0.19, 0.26, 0.12, 250.0), vec4(0.35, 0.35, 0.19, 700.0), vec4(0.34, 0.26, 0.14, 1400.0),
    vec4(0.25, 0.17, 0.10, 2400.0),
    vec4(0.30, 0.28, 0.26, 3600.0), vec4(0.49, 0.49, 0.50, 5500.0));

uniform vec4 u_ramp[10];  // a ramp of colours by height: light.ramps.Ramp.stops

Material land_of(vec2 post, vec2 extent, Relief fine) {
    if (LOOK == EARTH) return earth_land(length(fine.slope) / u_exaggeration, patchiness(post, extent));
    if (LOOK == GREY) return Material(vec3(0.26), 0.9);
    if (LOOK == TINT) return Material(between_stops(TINTS, fine.height_m + u_base_m), 0.95);
    if (LOOK == RAMP) return Material(between_stops(u_ramp, fine.height_m + u_base_m), 0.95);
    return natural_land(post, extent, fine);
}

// The material of a footprint; details smaller than its extent, in posts, fade.
Material material_of(vec2 post, vec2 extent, Relief fine) {
    vec4 picture = PICTURED ? picture_of(post, extent) : vec4(0.0);
    Material pictured = Material(picture.rgb / max(picture.a, 1e-6), 0.8);
    if (picture.a > 0.999) return pictured;
    Material land = land_of(post, extent, fine);
    if (MARKED) {
        vec2 marked = marked_at(post);
        if (!IS_DIAGRAM) land = mixed(land, WET_GROUND, smoothstep(0.3, 0.7, marked.y));
        land = mixed(land, FILLED, smoothstep(0.0, 1.0, marked.x));
    }
    return mixed(land, pictured, picture.a);
}
