// lod/rings/place.comp — where each block's patches go in the list, and the draw commands: lod/place.glsl.

#include "lod/rings/shapes.glsl"
#include "lod/place.glsl"

// A patch has (T + 1)² vertices, and each edge may be cut into 64 segments.
uint most_vertices(int size) {
    uint side = (1u << size) + 1u;
    return side * side + 4u * uint(64 - (1 << size));
}

void main() {
    int thread = int(gl_LocalInvocationIndex), blocks = blocks_in_all();
    place_patches(thread, blocks, u_most_blocks);
    if (thread > 0) return;
    b_all.groups = uint(blocks + BLOCK_GROUP - 1) / uint(BLOCK_GROUP);
    mesh_unagreed = b_queue[u_agreed & 7].count;
    mesh_blocks = b_all.count;
}
