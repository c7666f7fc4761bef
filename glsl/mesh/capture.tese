// mesh/capture.tese — a vertex as the mesh export wants it: its post and the height the GPU drew it at.

#include "mesh/lattice.glsl"

layout(quads, equal_spacing, cw) in;

patch in uvec2 v_shape;
out vec3 v_vertex;  // column, row, metres above base

void main() {
    ivec2 post = post_at(lattice_of(v_shape), gl_TessCoord.xy);
    v_vertex = vec3(post, height_m(post));
}
