// mesh/patch.tese — a vertex: its post and the height there; between four posts, the bilinear height.
// Python twins: reference.vertex_heights, mesh.vertex_heights

#include "mesh/shape.glsl"
#include "mesh/between.glsl"
#include "mesh/vertex.glsl"

// rows count southward, so the tessellator's plane is mirrored on the map
layout(quads, equal_spacing, cw) in;

patch in ivec4 v_shape;

void main() {
    Shape s = shape_of(v_shape);
    ivec2 place = place_of(s, gl_TessCoord.xy), post = place >> 6;
    vec2 between = vec2(place & 63) / 64.0;
    Patch p = Patch(max(s.corner, ivec2(0)), end_of(s), float(s.step_log2), intBitsToFloat(v_shape.w));
    put_vertex_between(post, between, bilinear_m(post, between), p);
}
