// shade/surface.frag — the first pass of a picture: which place on the map does each sample see?
//   Shading reads the map at that place, in a second pass. So it is done once a pixel, and owes nothing to the mesh.

#include "blocks/terrain.glsl"

in vec2 v_post;
layout(location = 0) out vec2 out_post;

void main() {
    // at the centroid: a pixel's centre may lie beside the triangle, and beyond the map
    vec2 post = clamp(interpolateAtCentroid(v_post), vec2(0.0), vec2(u_last_post));
    if (is_hole(min(ivec2(post), u_last_post - 1))) discard;
    out_post = post;
}
