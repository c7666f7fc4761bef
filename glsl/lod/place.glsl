// lod/place.glsl — where each patch goes in the list, and the draw commands. One work group does it all.
//   Each count is replaced by the sum of all counts before it: sizes in order, and parts (blocks or tiles of the map)
//   in order within a size. Reduce, scan and propagate as in sat/; each thread owns one range of counts:
//
//     3 1 │ 4 1 │ 5 9   →   4, 5, 14   →   0, 4, 9   →   0 3 │ 4 8 │ 9 14
//
//   Tessellation makes at most MOST_VERTICES vertices of the patches of one command.
// Provides place_patches(). The including file has mesh_count[], mesh_offset[], and most_vertices() of a patch.

#include "lod/scan.glsl"

layout(local_size_x = SCANNERS) in;

struct DrawArrays {
    uint count, instances, first, base_instance, unused;  // moderngl reads one command every 20 bytes
};
layout(std430, binding = 6) writeonly buffer Draws { DrawArrays draws[]; };

uniform int u_most_draws;

uint most_vertices(int size);

void write_draws(int thread) {
    uint first = 0u, draw = 0u;
    for (int size = 0; size < SIZES; size++) {
        uint most = uint(MOST_VERTICES) / most_vertices(size);
        for (uint begin = 0u; begin < mesh_count[size]; begin += most, draw++)
            if (draw % uint(SCANNERS) == uint(thread) && draw < uint(u_most_draws))
                draws[draw] = DrawArrays(min(most, mesh_count[size] - begin), 1u, first + begin, 0u, 0u);
        first += mesh_count[size];
    }
    for (uint i = draw + uint(thread); i < uint(u_most_draws); i += uint(SCANNERS))
        draws[i] = DrawArrays(0u, 0u, 0u, 0u, 0u);
}

// The count of a size in part i is mesh_offset[size * row + i].
void place_patches(int thread, int parts, int row) {
    int n = SIZES * parts;
    int stretch = (n + SCANNERS - 1) / SCANNERS, first = min(thread * stretch, n), end = min(first + stretch, n);
    uint sum = 0u;
    for (int i = first; i < end; i++) sum += mesh_offset[i / parts * row + i % parts];
    uint before = sum_before(thread, sum);
    for (int i = first; i < end; i++) {
        int at = i / parts * row + i % parts;
        uint count = mesh_offset[at];
        mesh_offset[at] = before;
        before += count;
    }
    write_draws(thread);
}
