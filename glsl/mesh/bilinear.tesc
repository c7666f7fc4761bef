// mesh/bilinear.tesc — every cell of a full-resolution patch is cut in FINER × FINER.

#include "mesh/lattice.glsl"

#ifndef FINER
#define FINER 2
#endif

layout(vertices = 1) out;

in uvec2 v_patch[];
patch out uvec2 v_shape;

void main() {
    v_shape = v_patch[0];
    float segments = float(FINER * lattice_of(v_shape).segments);
    for (int edge = 0; edge < 4; edge++) gl_TessLevelOuter[edge] = segments;
    gl_TessLevelInner[0] = gl_TessLevelInner[1] = segments;
}
