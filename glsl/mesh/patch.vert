// mesh/patch.vert — passes on a patch, which is one vertex of four words (mesh/shape.glsl,
// comparison/tessellated/patch.glsl).

in ivec4 in_patch;
out ivec4 v_patch;

void main() { v_patch = in_patch; }
