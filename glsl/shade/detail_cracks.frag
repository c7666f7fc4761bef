// shade/detail_cracks.frag — the first pass for style "cracks": 1 where a sample sees the underside of the land.
//   An eye above a whole mesh never sees it. Through a crack it looks under the land, and meets it from below.

#include "shade/detail.glsl"

void main() { put_detail(gl_FrontFacing ? 0.0 : 1.0); }
