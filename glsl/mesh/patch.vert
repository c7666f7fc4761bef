// mesh/patch.vert — a patch is one vertex: two words (mesh/lattice.glsl).

in uvec2 in_patch;
out uvec2 v_patch;

void main() { v_patch = in_patch; }
