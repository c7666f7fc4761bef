// comparison/tessellated/patch.vert — a patch is one vertex: four words (comparison/tessellated/patch.glsl).

in uvec4 in_cut;
out uvec4 v_cut;

void main() { v_cut = in_cut; }
