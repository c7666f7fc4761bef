// mesh/patch.tese — a vertex: its post, and the height there.

#include "mesh/lattice.glsl"
#include "mesh/vertex.glsl"

// rows run south, so the plane of tessellation is seen from below
layout(quads, equal_spacing, cw) in;

patch in uvec2 v_shape;

void main() {
    Lattice l = lattice_of(v_shape);
    ivec2 post = post_at(l, gl_TessCoord.xy), high = l.corner + (l.segments << l.step_log2);
    put_vertex(post, height_m(post), Patch(l.corner, high, float(l.step_log2), l.fan, l.split_edges));
}
