// mesh/error.frag — the error of the drawn triangle at one place, in metres: positive if it is above the truth.
//   Each pixel is one place: a cell has PLACES × PLACES places, posts included. Coordinates are counted in UNITS to the
//   distance between posts: then those of all vertices and places are integers, and so are all areas. All are below
//   2^53, so double precision is exact.
//   The triangle is drawn with the drops of its corners, and the truth has the drop of the place (blocks/view.glsl). A
//   plane that is added to both does not change their difference. So we may take the drops for an eye at the place
//   itself, where they are small.

#undef TO
#define TO ABOVE  // this shader is only used from above
#include "mesh/to.glsl"
#include "blocks/view.glsl"

flat in vec3 v_a, v_b, v_c;  // column, row, metres above base
layout(r32f, binding = 0) uniform writeonly image2D u_error_m;

const double UNITS = 64.0LF * double(PLACES);

double doubled_area(dvec2 a, dvec2 b, dvec2 c) { return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x); }

// For a paged map, the truth is uploaded window by window.
#ifdef PAGED
layout(binding = 13) uniform sampler2D u_truth;
uniform ivec2 u_truth_first;  // first post of the window
float true_m(ivec2 post) { return texelFetch(u_truth, post - u_truth_first, 0).x; }
#else
float true_m(ivec2 post) { return height_m(post); }
#endif

// The truth: bilinear between four posts.
double truth_m(ivec2 place) {
    ivec2 post = place / PLACES, next = min(post + 1, u_last_post);
    dvec2 t = dvec2(place % PLACES) / double(PLACES);
    double north = mix(double(true_m(post)), double(true_m(ivec2(next.x, post.y))), t.x);
    double south = mix(double(true_m(ivec2(post.x, next.y))), double(true_m(next)), t.x);
    return mix(north, south, t.y);
}

// The drop of a vertex, for an eye above `at`. Both places are in UNITS.
double drop_near_m(dvec2 vertex, dvec2 at) {
    dvec2 away = (vertex - at) / UNITS * dvec2(u_spacing_m), between = fract(vertex / UNITS);
    return double(u_bend_per_m) * dot(away, away) + dot(dvec2(u_bulge_m), between * (1.0 - between));
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    pixel = ivec2(u_flip.x != 0 ? u_tile_size.x - 1 - pixel.x : pixel.x,
                  u_flip.y != 0 ? u_tile_size.y - 1 - pixel.y : pixel.y);
    ivec2 place = u_tile + pixel;
    dvec2 at = dvec2(place * 64);
    dvec2 a = UNITS * dvec2(v_a.xy);
    dvec2 b = UNITS * dvec2(v_b.xy);
    dvec2 c = UNITS * dvec2(v_c.xy);
    double wa = doubled_area(at, b, c), wb = doubled_area(a, at, c), wc = doubled_area(a, b, at);
    double a_m = double(v_a.z) - drop_near_m(a, at);
    double b_m = double(v_b.z) - drop_near_m(b, at);
    double c_m = double(v_c.z) - drop_near_m(c, at);
    double drawn_m = (wa * a_m + wb * b_m + wc * c_m) / (wa + wb + wc);
    imageStore(u_error_m, pixel, vec4(float(drawn_m - (truth_m(place) - drop_near_m(at, at)))));
}
