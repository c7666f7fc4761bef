// shade/detail_promise.frag — the first pass for style "promise":
//   the certified bound of the whole patch, in pixels, from its record. A negative number means: no bound.

#include "shade/detail.glsl"

void main() { put_detail(patch_of(g_of_patch).bound_px); }
