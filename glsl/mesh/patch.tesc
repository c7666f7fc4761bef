// mesh/patch.tesc — the tessellation levels of a patch.
//   Squares of quads have T segments along every edge, and inside. Fans have inner level 2, which is one vertex, the
//   centre; an edge has one segment, or two if the neighbour is finer. From above, patches outside the picture are
//   dropped.
// Python twins: reference.patch_triangles, reference.fan_triangles

#include "mesh/lattice.glsl"
#include "mesh/to.glsl"

layout(vertices = 1) out;

in uvec2 v_patch[];
patch out uvec2 v_shape;

void main() {
    v_shape = v_patch[0];
    Lattice l = lattice_of(v_shape);
    bool beside = is_beside(l.corner, l.corner + side_of(l));
    for (int edge = 0; edge < 4; edge++) {
        float of_fan = (l.split_edges >> edge & 1u) != 0u ? 2.0 : 1.0;
        gl_TessLevelOuter[edge] = beside ? 0.0 : l.fan ? of_fan : float(l.segments);
    }
    gl_TessLevelInner[0] = gl_TessLevelInner[1] = float(l.segments);
}
