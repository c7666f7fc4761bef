// shade/surface.frag — the first pass of a picture: which place on the map does each sample see?
//   Shading reads the map at that place, in a second pass. So it is done once a pixel, and owes nothing to the mesh.

#include "shade/place.glsl"

in vec2 v_post;
flat in uvec2 v_patch_shape;
layout(location = 0) out vec2 out_post;

void main() {
    out_post = place_in_patch(v_post, lattice_of(v_patch_shape));
    if (is_in_hole(out_post)) discard;
}
