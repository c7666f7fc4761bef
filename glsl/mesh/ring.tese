// mesh/ring.tese — a vertex of the clipmap: its post and the height there; between four posts, the bilinear height.

#include "mesh/ring.glsl"
#include "mesh/between.glsl"
#include "mesh/vertex.glsl"

// rows count to the south, so the plane of tessellation is seen from below
layout(quads, equal_spacing, cw) in;

patch in ivec4 v_shape;

void main() {
    RingShape s = ring_shape(v_shape);
    ivec2 place = place_of(s, gl_TessCoord.xy), post = place >> 6;
    Patch p = Patch(max(s.corner, ivec2(0)), s.corner + (1 << s.side_log2), float(s.step_log2), false, 0u,
                    intBitsToFloat(v_shape.w));
    vec2 between = vec2(place & 63) / 64.0;
    put_vertex_between(post, between, bilinear_m(post, between), p);
}
