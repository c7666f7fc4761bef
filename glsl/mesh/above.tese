// mesh/above.tese — the mesh seen from straight above, one pixel a post: what mesh/error.frag measures.
//   A post on a triangle's edge belongs to one side only, by the rasteriser's rule, and on the map's far edges to none;
//   u_flip turns the picture, so that every edge is a near one in one of four draws.

#include "mesh/lattice.glsl"

layout(quads, equal_spacing, cw) in;

uniform ivec2 u_tile;       // post of the picture's first pixel
uniform ivec2 u_tile_size;  // pixels
uniform ivec2 u_flip;

patch in uvec2 v_shape;
out vec3 v_vertex;  // column, row, metres above base

void main() {
    ivec2 post = post_at(lattice_of(v_shape), gl_TessCoord.xy);
    v_vertex = vec3(post, height_m(post));
    vec2 pixel = vec2(post - u_tile) + 0.5;
    pixel = mix(pixel, vec2(u_tile_size) - pixel, vec2(u_flip));
    gl_Position = vec4(pixel / vec2(u_tile_size) * 2.0 - 1.0, 0.0, 1.0);
}
