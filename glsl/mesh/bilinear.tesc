// mesh/bilinear.tesc — every cell of a full-resolution patch in the picture is cut in FINER × FINER parts.

#include "mesh/shape.glsl"
#include "mesh/to.glsl"

#ifndef FINER
#define FINER 2
#endif

layout(vertices = 1) out;

in ivec4 v_patch[];
patch out ivec4 v_shape;

void main() {
    v_shape = v_patch[0];
    Shape s = shape_of(v_shape);
    float segments = is_beside(s.corner, end_of(s)) ? 0.0 : float(FINER << s.side_log2);
    for (int edge = 0; edge < 4; edge++) gl_TessLevelOuter[edge] = segments;
    gl_TessLevelInner[0] = gl_TessLevelInner[1] = segments;
}
