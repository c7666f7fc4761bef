// lod/quadtree/offsets.comp — where each tile's patches begin:
//   each count is replaced by the sum of all counts before it, ordered by size and then by tile.
//   Reduce, scan and propagate as in sat/, in one work group: each thread owns one range of counts.
//
//     3 1 │ 4 1 │ 5 9   →   4, 5, 14   →   0, 4, 9   →   0 3 │ 4 8 │ 9 14

#include "blocks/terrain.glsl"
#include "lod/quadtree/tiles.glsl"
#include "lod/scan.glsl"

layout(local_size_x = SCANNERS) in;

void main() {
    int thread = int(gl_LocalInvocationIndex), n = SIZES * tiles_in_all();
    int stretch = (n + SCANNERS - 1) / SCANNERS, first = thread * stretch, end = min(first + stretch, n);
    uint sum = 0u;
    for (int i = first; i < end; i++) sum += offset[i];
    uint before = sum_before(thread, sum);
    for (int i = first; i < end; i++) {
        uint count = offset[i];
        offset[i] = before;
        before += count;
    }
}
