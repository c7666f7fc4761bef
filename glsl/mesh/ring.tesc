// mesh/ring.tesc — the tessellation levels of a patch of the clipmap, from its record: inside, its own; at each edge,
//   those of
// the finer side.

#include "mesh/ring.glsl"
#include "mesh/to.glsl"

layout(vertices = 1) out;

in ivec4 v_patch[];
patch out ivec4 v_shape;

void main() {
    v_shape = v_patch[0];
    RingShape s = ring_shape(v_shape);
    bool beside = is_beside(s.corner, s.corner + (1 << s.side_log2));
    for (int edge = 0; edge < 4; edge++) gl_TessLevelOuter[edge] = beside ? 0.0 : float(s.edges[edge]);
    gl_TessLevelInner[0] = gl_TessLevelInner[1] = exp2(float(s.side_log2 - s.step_log2));
}
