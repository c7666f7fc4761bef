// mesh/star.tese — where the tessellator puts a vertex, and in which patch.

layout(quads, equal_spacing, cw) in;  // as mesh/ring.tese

out vec3 v_place;

void main() { v_place = vec3(gl_TessCoord.xy, gl_PrimitiveID); }
