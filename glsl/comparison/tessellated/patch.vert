// comparison/tessellated/patch.vert — passes on a patch, which is one vertex of four words
//   (comparison/tessellated/patch.glsl).

in uvec4 in_cut;
out uvec4 v_cut;

void main() { v_cut = in_cut; }
