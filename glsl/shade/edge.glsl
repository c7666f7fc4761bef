// shade/edge.glsl — the surroundings of the map.
//   The map is a block of ground, cut off at its rim, on a plain or in a sea that reaches to the horizon.
//   These are no part of the mesh: a formula gives the point where a ray meets them.
//
//        eye ·-._                        rim     a ray that enters the map's rectangle below the rim
//                 `-._       ____/‾‾\__ /         meets the wall there; a ray that reaches the
//   ____________________`-._|__________|_______  u_edge_m     plain first meets the plain
//
// Provides EDGE, Ray, plane_depth(), under_rim_depth(), wall_normal(), surroundings_at(), wall_depth(),
// plain_depth(), rim_m_at().

#include "blocks/view.glsl"

#ifndef EDGE
#define EDGE 0  // 1: the plain is drawn; 2: the wall, too. From an eye above the map, no ray meets the wall
#endif

struct Ray {
    vec3 start, along;  // metres from the eye; 0 in perspective
};

uniform float u_edge_m;  // height of the plain or the sea, above the base of the map's heights

// The view depth t at which a ray meets a level plane from above; negative if it does not. The ray's component along
// the view is 1. The plane has the drop of the land, so t is the smaller solution of
//   u_bend_per_m (x² + y²) t² + z t = height_m - eye.
// For parallel rays the ground is flat.
float plane_depth(Ray seen, float height_m) {
    vec3 ray = seen.along;
    float down_m = up_from_eye_m(height_m) - seen.start.z, inside = ray.z * ray.z + 4.0 * drop_m(ray.xy) * down_m;
    return down_m < 0.0 && ray.z < 0.0 && inside >= 0.0 ? 2.0 * down_m / (ray.z - sqrt(inside)) : -1.0;
}

float plain_depth(Ray ray) { return plane_depth(ray, u_edge_m); }

// From metres relative to the eye to a place on the map; corner_m is the south-western post.
vec2 rim_place(vec2 at_m, vec2 corner_m) {
    vec2 post = (at_m - corner_m) / u_spacing_m;
    return clamp(vec2(post.x, float(u_last_post.y) - post.y), vec2(0.0), vec2(u_last_post));
}

float rim_m_at(vec2 place) {
    ivec2 at = min(ivec2(place), u_last_post - 1);
    vec2 t = place - vec2(at);
    return mix(mix(height_m(at), height_m(at + ivec2(1, 0)), t.x),
        mix(height_m(at + ivec2(0, 1)), height_m(at + 1), t.x), t.y);
}

// The view depth at which a ray from outside enters the map's rectangle; negative if it does not.
float entry_depth(Ray seen) {
    vec3 ray = seen.along;
    vec2 low = post_from_eye_m(ivec2(0, u_last_post.y)) - seen.start.xy;
    vec2 high = post_from_eye_m(ivec2(u_last_post.x, 0)) - seen.start.xy;
    if (all(lessThan(low, vec2(0.0))) && all(greaterThan(high, vec2(0.0)))) return -1.0;
    vec2 along = mix(ray.xy, vec2(1e-12), lessThan(abs(ray.xy), vec2(1e-12)));
    vec2 a = low / along, b = high / along, first = min(a, b), last = max(a, b);
    float near = max(first.x, first.y);
    return near > 0.0 && near < min(last.x, last.y) ? near : -1.0;
}

// The view depth at which a ray enters the map's rectangle below the rim, negative if it does not; and the place on the
// rim there.
float under_rim_depth(Ray ray, out vec2 place) {
    float entry = entry_depth(ray);
    vec3 at_m = ray.start + entry * ray.along;
    place = rim_place(at_m.xy, post_from_eye_m(ivec2(0, u_last_post.y)));
    float rim_m = up_from_eye_m(rim_m_at(place)) - drop_m(at_m.xy);
    return EDGE == 2 && entry > 0.0 && at_m.z < rim_m ? entry : -1.0;
}

// The same for a ray that meets the wall there, and not the plain before.
float wall_depth(Ray ray, out vec2 place) {
    float wall = under_rim_depth(ray, place), plain = plain_depth(ray);
    return plain > 0.0 && plain < wall ? -1.0 : wall;
}

vec3 wall_normal(vec2 place) {
    vec2 last = vec2(u_last_post), off = min(place, last - place);
    return off.x < off.y ? vec3(place.x < 0.5 * last.x ? -1.0 : 1.0, 0.0, 0.0)
        : vec3(0.0, place.y < 0.5 * last.y ? 1.0 : -1.0, 0.0);
}

// For a ray that meets no land: 0 if it meets nothing, 1 for the plain, other numbers for the four walls.
int surroundings_at(Ray ray) {
    vec2 place;
    if (EDGE == 2 && wall_depth(ray, place) > 0.0) return 4 + int(dot(wall_normal(place), vec3(1.0, 2.0, 0.0)));
    return EDGE > 0 && plain_depth(ray) > 0.0 ? 1 : 0;
}
