// mesh/between.glsl — the truth between four posts is bilinear:
//     h = (1 - s)(1 - t) a + s (1 - t) b + (1 - s) t c + s t d
// Provides bilinear_m().   Python twin: mesh.vertex_heights

#include "blocks/terrain.glsl"

// Not mix(): compilers may compute that as a + t (b - a), whose rounding errors rounding_between_m() does not bound.
float blend_m(float a, float b, float t) {
    precise float y = a * (1.0 - t) + b * t;
    return y;
}

// `t` is the fraction of the way from the post to the next one, east and south. On the post itself the result is exact.
float bilinear_m(ivec2 post, vec2 t) {
    if (t == vec2(0.0)) return height_m(post);
    ivec2 next = min(post + 1, u_last_post);
    float north = blend_m(height_m(post), height_m(ivec2(next.x, post.y)), t.x);
    float south = blend_m(height_m(ivec2(post.x, next.y)), height_m(next), t.x);
    return blend_m(north, south, t.y);
}
