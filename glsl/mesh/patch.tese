// mesh/patch.tese — a vertex: its post, and the height there; amid four posts, their mean.
// Python twin of that: mesh.vertex_heights

#include "mesh/lattice.glsl"
#include "mesh/vertex.glsl"

// rows run south, so the plane of tessellation is seen from below
layout(quads, equal_spacing, cw) in;

patch in uvec2 v_shape;

float middle_m(ivec2 cell) {
    ivec2 next = cell + 1;
    return 0.25 * ((height_m(cell) + height_m(ivec2(next.x, cell.y))) + (height_m(ivec2(cell.x, next.y)) + height_m(next)));
}

void main() {
    Lattice l = lattice_of(v_shape);
    ivec2 halves = halves_at(l, gl_TessCoord.xy), high = l.corner + (l.segments << l.step_log2) / 2;
    Patch p = Patch(l.corner, high, float(l.step_log2 - 1), l.fan, l.split_edges);
    if ((halves & 1) == ivec2(0)) put_vertex(halves / 2, height_m(halves / 2), p);
    else put_vertex_between(halves / 2, vec2(0.5), middle_m(halves / 2), p);
}
