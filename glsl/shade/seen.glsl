// shade/seen.glsl — the result of the first pass: the depth of every sample.
//   Depth and ray give the place on the map that the sample sees.
//   depth d = near / z, and 0 for the sky         z: metres along the view
//   place  = eye + z (forward + x right + y up)    x, y: where the sample is in the picture
//   The rays of an orthographic camera are parallel: d = 1 − z / span, place = (eye + x right + y up) + z forward.
// Provides SAMPLES, FRAG_COORD, find_hidden(), place_of_sample_m(), post_of_sample(), is_sky(), view_ray().

#include "blocks/view.glsl"
#include "shade/edge.glsl"
#include "shade/kind.glsl"
#include "shade/sample_at.glsl"

#ifndef SAMPLES
#define SAMPLES 4
#endif

#if SAMPLES > 1
#define PER_SAMPLE sampler2DMS
#else
#define PER_SAMPLE sampler2D
#endif

layout(binding = 2) uniform PER_SAMPLE u_depth;

// Pixels of kind MIXED, column and row in 16 bits each: shade/kind.frag lists them, in any order.
layout(std430, binding = 6) buffer Listed {
    uint listed_groups[3];  // dispatch size, for groups of 64 pixels
    uint listed_count;
    uint listed[];
};

#ifdef LISTED
vec4 g_frag_coord;
#define FRAG_COORD g_frag_coord
#else
#define FRAG_COORD gl_FragCoord
#endif

vec2 offset_of_sample(int i) { return SAMPLES == 4 ? SAMPLE_AT[i] : vec2(0.0); }

// The ray through a place in the pixel. The component of `along` in the direction of the view is one metre.
Ray ray_at(vec2 offset_px) {
    vec2 at = ((picture_px(FRAG_COORD) + offset_px) / vec2(u_size_px) * 2.0 - 1.0) * u_half_extent + u_centre;
    if (is_orthographic()) return Ray(at.x * u_right.xyz + at.y * u_up.xyz, u_forward.xyz);
    return Ray(vec3(0.0), u_forward.xyz + at.x * u_right.xyz + at.y * u_up.xyz);
}

// The same ray; `along` has length one.
Ray view_ray(vec2 offset_px) {
    Ray ray = ray_at(offset_px);
    ray.along = normalize(ray.along);
    return ray;
}

int g_hidden = 0;  // samples, as bits, whose rays enter the map's block below its rim: they see no land

// Sets g_hidden. Call it before post_of_sample().
void find_hidden() {
#if EDGE == 2 && PIXELS != NEAR
    vec2 place;
    for (int i = 0; i < SAMPLES; i++) g_hidden |= int(under_rim_depth(ray_at(offset_of_sample(i)), place) > 0.0) << i;
#endif
}

float view_depth_m(float depth) {
    return is_orthographic() ? (1.0 - depth) * u_depth_span_m : near_m() / max(depth, 1e-30);
}

vec3 place_of_sample_m(int i, float depth) {
    Ray ray = ray_at(offset_of_sample(i));
    return ray.start + ray.along * view_depth_m(depth);
}

// Column and row of a place, given in metres from the eye.
vec2 post_at(vec2 at_m) {
    vec2 from_post_m = at_m + u_eye_offset_m;
    return vec2(u_eye_post) + vec2(from_post_m.x, -from_post_m.y) / u_spacing_m;
}

// Column and row of the place on the map; negative for the sky, and for the surroundings of the map.
vec2 post_of_sample(int i) {
    float depth = texelFetch(u_depth, ivec2(FRAG_COORD.xy), i).x;
    vec2 post = post_at(place_of_sample_m(i, depth).xy);
    bool is_land = depth > 0.0 && (g_hidden >> i & 1) == 0;
    return is_land ? clamp(post, vec2(0.0), vec2(u_last_post)) : vec2(-1.0);
}

bool is_sky(vec2 post) { return post.x < 0.0; }
