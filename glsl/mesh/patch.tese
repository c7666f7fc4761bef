// mesh/patch.tese — a vertex: its post and the height there; between four posts, the bilinear height.
// Python twins: reference.vertex_heights, mesh.vertex_heights

#include "mesh/lattice.glsl"
#include "mesh/between.glsl"
#include "mesh/vertex.glsl"

// rows count to the south, so the plane of tessellation is seen from below
layout(quads, equal_spacing, cw) in;

patch in uvec2 v_shape;

void main() {
    Lattice l = lattice_of(v_shape);
    ivec2 place = place_at(l, gl_TessCoord.xy), post = place >> 6;
    vec2 between = vec2(place & 63) / 64.0;
    put_vertex_between(post, between, bilinear_m(post, between),
                       Patch(l.corner, l.corner + side_of(l), float(l.step_log2 - 6), l.fan, l.split_edges, -1.0));
}
