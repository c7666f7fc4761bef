// lod/offsets.comp — where each tile's patches go: counts become the sums of all counts before them, tile after tile,
// size after size. One work group walks along the counts, 1024 at a time, and scans each stretch in steps of doubling
// reach (Hillis, Steele 1986):
//
//     3 1 4 1   →   3 4 5 5   →   3 4 8 9   →   carry 9 to the next stretch; what stands before: 0 3 4 8
//
#include "blocks/terrain.glsl"
#include "lod/tiles.glsl"

#define WIDTH 1024

layout(local_size_x = WIDTH) in;

shared uint s_sum[WIDTH];

void main() {
    int thread = int(gl_LocalInvocationIndex), n = SIZES * tiles_in_all();
    uint carry = 0u;
    for (int stretch = 0; stretch < n; stretch += WIDTH) {
        int i = stretch + thread;
        uint own = i < n ? offset[i] : 0u;
        s_sum[thread] = own;
        for (int reach = 1; reach < WIDTH; reach *= 2) {
            barrier();
            uint before = thread >= reach ? s_sum[thread - reach] : 0u;
            barrier();
            s_sum[thread] += before;
        }
        barrier();
        if (i < n) offset[i] = carry + s_sum[thread] - own;
        carry += s_sum[WIDTH - 1];
        barrier();
    }
}
