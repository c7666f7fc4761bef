// lod/quadtree/draws.comp — indirect draw commands for the patches of each size.
//   Tessellation makes at most MOST_VERTICES vertices of the patches of one command.

#include "blocks/terrain.glsl"
#include "lod/quadtree/tiles.glsl"

#ifndef MOST_VERTICES
#define MOST_VERTICES 65535  // gl.MOST_VERTICES
#endif

layout(local_size_x = GROUP) in;

struct DrawArrays {
    uint count, instances, first, base_instance, unused;  // 20 bytes, as moderngl expects
};
layout(std430, binding = 5) writeonly buffer Draws { DrawArrays draws[]; };

uint most_in_draw(int size) {
    uint side = (1u << size) + 1u;
    return uint(MOST_VERTICES) / (side * side);
}

void main() {
    uint draw = gl_GlobalInvocationID.x, first = 0u;
    for (int size = 0; size < SIZES; size++) {
        uint most = most_in_draw(size), needed = (s_count[size] + most - 1u) / most;
        if (draw < needed) {
            uint begin = draw * most;
            draws[gl_GlobalInvocationID.x] = DrawArrays(min(most, s_count[size] - begin), 1u, first + begin, 0u, 0u);
            return;
        }
        draw -= needed;
        first += s_count[size];
    }
}
