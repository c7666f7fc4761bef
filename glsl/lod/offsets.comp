// lod/offsets.comp — where each tile's patches begin: each count is replaced by the sum of all counts before it, ordered by
// size and then by tile. Reduce, scan and propagate as in sat/, in one work group: each thread owns one range of counts.
//
//     3 1 │ 4 1 │ 5 9   →   4, 5, 14   →   0, 4, 9   →   0 3 │ 4 8 │ 9 14

#include "blocks/terrain.glsl"
#include "lod/tiles.glsl"

#define THREADS 256

layout(local_size_x = THREADS) in;

shared uint s_sum[THREADS];

// The sum of all ranges before each thread's own (Hillis, Steele 1986).
uint scan(int thread, uint own) {
    s_sum[thread] = own;
    for (int reach = 1; reach < THREADS; reach *= 2) {
        barrier();
        uint before = thread >= reach ? s_sum[thread - reach] : 0u;
        barrier();
        s_sum[thread] += before;
    }
    return s_sum[thread] - own;
}

void main() {
    int thread = int(gl_LocalInvocationIndex), n = SIZES * tiles_in_all();
    int stretch = (n + THREADS - 1) / THREADS, first = thread * stretch, end = min(first + stretch, n);
    uint sum = 0u;
    for (int i = first; i < end; i++) sum += offset[i];
    uint before = scan(thread, sum);
    for (int i = first; i < end; i++) {
        uint count = offset[i];
        offset[i] = before;
        before += count;
    }
}
