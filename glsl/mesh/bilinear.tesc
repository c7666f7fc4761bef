// mesh/bilinear.tesc — every cell of a full-resolution patch in the picture is cut in FINER × FINER parts.

#include "mesh/lattice.glsl"
#include "mesh/to.glsl"

#ifndef FINER
#define FINER 2
#endif

layout(vertices = 1) out;

in uvec2 v_patch[];
patch out uvec2 v_shape;

void main() {
    v_shape = v_patch[0];
    Lattice l = lattice_of(v_shape);
    float segments = is_beside(l.corner, l.corner + l.segments) ? 0.0 : float(FINER * l.segments);
    for (int edge = 0; edge < 4; edge++) gl_TessLevelOuter[edge] = segments;
    gl_TessLevelInner[0] = gl_TessLevelInner[1] = segments;
}
