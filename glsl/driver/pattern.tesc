// driver/pattern.tesc — tessellation levels for terrain_gl/gpu/pattern.py, set as mesh/patch.tesc sets them.

layout(vertices = 1) out;

in vec4 v_edges[];
in vec2 v_inside[];
patch out float v_number;

void main() {
    for (int edge = 0; edge < 4; edge++) gl_TessLevelOuter[edge] = v_edges[0][edge];
    gl_TessLevelInner[0] = gl_TessLevelInner[1] = v_inside[0].x;
    v_number = v_inside[0].y;
}
