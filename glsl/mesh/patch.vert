// mesh/patch.vert — a patch is one vertex: four words (mesh/shape.glsl).

in ivec4 in_patch;
out ivec4 v_patch;

void main() { v_patch = in_patch; }
