// lod/rings/place.comp — where each block's patches go in the list. Each count is replaced by the sum of all counts
// before it: sizes in order, and blocks in order within a size. Then come the draw commands: tessellation makes at most
// MOST_VERTICES vertices of each. One work group does it all, by reduce, scan and propagate as in sat/; each thread
// owns one range of counts.

#include "lod/rings/shapes.glsl"
#include "lod/scan.glsl"

#ifndef MOST_VERTICES
#define MOST_VERTICES 65535  // gl.MOST_VERTICES
#endif

layout(local_size_x = SCANNERS) in;

struct DrawArrays {
    uint count, instances, first, base_instance, unused;  // moderngl reads one command every 20 bytes
};
layout(std430, binding = 5) writeonly buffer Draws { DrawArrays draws[]; };

uniform int u_most_draws;

// Patches that fit into one draw. A patch has (T + 1)² vertices, and each edge may be cut into 64 segments.
uint most_in_draw(int size) {
    uint side = (1u << size) + 1u;
    return uint(MOST_VERTICES) / (side * side + 4u * uint(64 - (1 << size)));
}

void write_draws(int thread) {
    uint first = 0u, draw = 0u;
    for (int size = 0; size < SIZES; size++) {
        uint most = most_in_draw(size);
        for (uint begin = 0u; begin < s_count[size]; begin += most, draw++)
            if (draw % uint(SCANNERS) == uint(thread) && draw < uint(u_most_draws))
                draws[draw] = DrawArrays(min(most, s_count[size] - begin), 1u, first + begin, 0u, 0u);
        first += s_count[size];
    }
    for (uint i = draw + uint(thread); i < uint(u_most_draws); i += uint(SCANNERS))
        draws[i] = DrawArrays(0u, 0u, 0u, 0u, 0u);
}

void main() {
    int thread = int(gl_LocalInvocationIndex), blocks = blocks_in_all(), n = SIZES * blocks;
    int stretch = (n + SCANNERS - 1) / SCANNERS, first = min(thread * stretch, n), end = min(first + stretch, n);
    uint sum = 0u;
    for (int i = first; i < end; i++) sum += s_offset[i / blocks * u_most_blocks + i % blocks];
    uint before = sum_before(thread, sum);
    for (int i = first; i < end; i++) {
        int at = i / blocks * u_most_blocks + i % blocks;
        uint count = s_offset[at];
        s_offset[at] = before;
        before += count;
    }
    write_draws(thread);
    if (thread > 0) return;
    b_all.groups = uint(blocks + BLOCK_GROUP - 1) / uint(BLOCK_GROUP);
    s_unagreed = b_queue[u_agreed & 7].count;
    s_blocks = b_all.count;
}
