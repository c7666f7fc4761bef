// comparison/tessellated/patch.tesc — pass on the levels that comparison/tessellated/levels.comp computed.

#include "comparison/tessellated/patch.glsl"

layout(vertices = 1) out;

in ivec4 v_patch[];
patch out uvec4 v_cut;

void main() {
    v_cut = uvec4(v_patch[0]);
    Cut c = cut_of(v_cut);
    ivec2 inner = inner_levels(c);
    for (int edge = 0; edge < 4; edge++) gl_TessLevelOuter[edge] = float(c.outer[edge]);
    gl_TessLevelInner[0] = float(inner.x);
    gl_TessLevelInner[1] = float(inner.y);
}
