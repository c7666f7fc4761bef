// horizon/normal.glsl — the ground's normal at a post, from the posts beside it.
//   Slope: central differences, one-sided at the map's rim.
// Provides slope_at(), normal_at().   Python twin: reference.post_slopes

#include "blocks/terrain.glsl"

vec2 slope_at(ivec2 post) {
    ivec2 before = max(post - 1, 0), after = min(post + 1, u_last_post);
    float east = height_m(ivec2(after.x, post.y)) - height_m(ivec2(before.x, post.y));
    float north = height_m(ivec2(post.x, before.y)) - height_m(ivec2(post.x, after.y));
    return vec2(east, north) / (vec2(after - before) * u_spacing_m);
}

vec3 normal_at(ivec2 post) { return normalize(vec3(-slope_at(post), 1.0)); }
