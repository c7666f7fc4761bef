// shade/detail_cracks.frag — the first pass for style "cracks": 1 where a sample sees the underside of the land.
//   An eye above a mesh without cracks never sees an underside. A ray through a crack meets the land from below.

#include "shade/detail.glsl"

void main() { put_detail(gl_FrontFacing ? 0.0 : 1.0); }
