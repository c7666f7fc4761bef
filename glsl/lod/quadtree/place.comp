// lod/quadtree/place.comp — where each tile's patches go in the list, and the draw commands: lod/place.glsl.

#include "lod/quadtree/tiles.glsl"
#include "lod/place.glsl"

uint most_vertices(int size) {
    uint side = (1u << size) + 1u;
    return side * side;
}

void main() { place_patches(int(gl_LocalInvocationIndex), tiles_in_all(), tiles_in_all()); }
