// mesh/patch.tesc — the tessellation levels of a patch, from its record. The inner level is the patch's own number of
//   segments. The level of an edge is the number of segments of its finer side. With OWN_EDGES it is the patch's own
//   number, so the mesh has cracks. In views from above, patches outside the picture are dropped. With FINER, each
//   segment of a patch is cut into FINER segments.
// Python twin: reference.patch_triangles

#include "mesh/shape.glsl"
#include "mesh/to.glsl"

#ifndef FINER
#define FINER 1
#endif

layout(vertices = 1) out;

in ivec4 v_patch[];
patch out ivec4 v_shape;

void main() {
    v_shape = v_patch[0];
    Shape s = shape_of(v_shape);
    bool beside = is_beside(s.corner, end_of(s));
    int finer_log2 = TO == PICTURE ? findMSB(FINER) : 0;
    int own_log2 = s.side_log2 - s.step_log2 + finer_log2;
    s.edges_log2 += finer_log2;
#ifdef OWN_EDGES
    s.edges_log2 = ivec4(own_log2);
#endif
    for (int edge = 0; edge < 4; edge++) gl_TessLevelOuter[edge] = beside ? 0.0 : exp2(float(s.edges_log2[edge]));
    gl_TessLevelInner[0] = gl_TessLevelInner[1] = exp2(float(own_log2));
}
