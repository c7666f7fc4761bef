// driver/pattern.tese — the places of a tessellator's vertices, in 64ths of a patch's side, as mesh/shape.glsl rounds
//   them, and the number of the patch.

layout(quads, equal_spacing, ccw) in;

patch in float v_number;
out vec3 v_place;

void main() { v_place = vec3(round(gl_TessCoord.xy * 64.0), v_number); }
