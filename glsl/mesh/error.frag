// mesh/error.frag — how far the drawn triangle is from the truth at this post, in metres: above it, positive.
//   The weights are areas of integer triangles, exact; the height between is computed in double precision.

#include "blocks/terrain.glsl"

flat in vec3 v_a, v_b, v_c;
uniform ivec2 u_tile, u_tile_size, u_flip;
layout(r32f, binding = 0) uniform writeonly image2D u_error_m;

int doubled_area(ivec2 a, ivec2 b, ivec2 c) { return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x); }

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    pixel = ivec2(u_flip.x != 0 ? u_tile_size.x - 1 - pixel.x : pixel.x,
                  u_flip.y != 0 ? u_tile_size.y - 1 - pixel.y : pixel.y);
    ivec2 post = u_tile + pixel, at = 2 * post, a = ivec2(2.0 * v_a.xy), b = ivec2(2.0 * v_b.xy), c = ivec2(2.0 * v_c.xy);
    double wa = double(doubled_area(at, b, c)), wb = double(doubled_area(a, at, c)), wc = double(doubled_area(a, b, at));
    double drawn = (wa * double(v_a.z) + wb * double(v_b.z) + wc * double(v_c.z)) / (wa + wb + wc);
    imageStore(u_error_m, pixel, vec4(float(drawn - double(height_m(post)))));
}
