// mesh/ring.vert — a patch of the clipmap is one vertex: four words (lod/rings/emit.comp).

in ivec4 in_patch;
out ivec4 v_patch;

void main() { v_patch = in_patch; }
