// mesh/error.frag — the error of the drawn triangle at one place, in metres: positive if it is above the truth.
//   Each pixel is one place: a cell has PLACES × PLACES places, posts included. Heights are counted from that of the
//   post north-west of the place, and distances from the place, in units of 1/PLACES of a post, or of 1/64 of that if a
//   vertex is between posts. Then distances are integers below 2^21, and areas are exact as pairs (mesh/pair.glsl).
//   What this loses: docs/precision.md, section 5.
//   The triangle is drawn with the drops of its corners, and the truth has the drop of the place (blocks/view.glsl). A
//   plane that is added to both does not change their difference. So we may take the drops for an eye at the place
//   itself, where they are small.

#undef TO
#define TO ABOVE  // this shader is only used from above
#include "mesh/to.glsl"
#include "mesh/pair.glsl"
#include "blocks/view.glsl"

flat in vec3 v_a, v_b, v_c;  // column, row, metres above base
layout(r32f, binding = 0) uniform writeonly image2D u_error_m;

// For a paged map, the truth is uploaded window by window.
#ifdef PAGED
layout(binding = 13) uniform sampler2D u_truth;
uniform ivec2 u_truth_first;  // first post of the window
float true_m(ivec2 post) { return texelFetch(u_truth, post - u_truth_first, 0).x; }
#else
float true_m(ivec2 post) { return height_m(post); }
#endif

// Twice the area of the triangle between the place and two corners, which are at a and b from it.
vec2 doubled_area(vec2 a, vec2 b) { return plus(product_of(a.x, b.y), -product_of(a.y, b.x)); }

// The drop of a vertex that is `away` posts from the place, for an eye above the place.
float drop_near_m(vec2 away, vec2 vertex) {
    vec2 away_m = away * u_spacing_m, between = fract(vertex);
    return u_bend_per_m * dot(away_m, away_m) + dot(u_bulge_m, between * (1.0 - between));
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    pixel = ivec2(u_flip.x != 0 ? u_tile_size.x - 1 - pixel.x : pixel.x,
                  u_flip.y != 0 ? u_tile_size.y - 1 - pixel.y : pixel.y);
    ivec2 place = u_tile + pixel, post = place / PLACES, part = place % PLACES;
    float from_m = true_m(post);

    vec3 corner[3] = vec3[3](v_a, v_b, v_c);
    bool is_between = any(notEqual(fract(vec4(v_a.xy, v_b.xy)), vec4(0.0))) || any(notEqual(fract(v_c.xy), vec2(0.0)));
    float parts = is_between ? 64.0 : 1.0;
    vec2 away[3], height[3];
    for (int i = 0; i < 3; i++) {
        away[i] = (corner[i].xy - vec2(post)) * (parts * float(PLACES)) - parts * vec2(part);
        float drop_m = drop_near_m(away[i] / (parts * float(PLACES)), corner[i].xy);
        height[i] = plus(sum_of(corner[i].z, -from_m), vec2(-drop_m, 0.0));
    }
    vec2 total = vec2(0.0), drawn = vec2(0.0);
    for (int i = 0; i < 3; i++) {
        vec2 weight = doubled_area(away[(i + 1) % 3], away[(i + 2) % 3]);
        total = plus(total, weight);
        drawn = plus(drawn, times(weight, height[i]));
    }

    // the truth: bilinear between four posts
    ivec2 next = min(post + 1, u_last_post), rest = PLACES - part;
    vec2 truth = times(sum_of(true_m(ivec2(next.x, post.y)), -from_m), vec2(float(part.x * rest.y), 0.0));
    truth = plus(truth, times(sum_of(true_m(ivec2(post.x, next.y)), -from_m), vec2(float(rest.x * part.y), 0.0)));
    truth = plus(truth, times(sum_of(true_m(next), -from_m), vec2(float(part.x * part.y), 0.0)));
    truth = over(truth, vec2(float(PLACES * PLACES), 0.0));

    vec2 error = plus(over(drawn, total), -truth);
    float drop_m = drop_near_m(vec2(0.0), vec2(part) / float(PLACES));
    imageStore(u_error_m, pixel, vec4(plus(error, vec2(drop_m, 0.0)).x));
}
