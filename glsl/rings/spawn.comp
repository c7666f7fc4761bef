// rings/spawn.comp — units that 64 segments cannot hold become blocks, in the order of their places: the same input gives
// the same blocks. One work group; each thread owns one stretch of the round's blocks.

#include "rings/rings.glsl"

#define SCANNERS 256

layout(local_size_x = SCANNERS) in;

uniform int u_round;  // the one that has been decided

shared uint s_sum[SCANNERS];

// What stands before each thread's stretch (Hillis, Steele 1986).
uint scan(int thread, uint own) {
    s_sum[thread] = own;
    for (int reach = 1; reach < SCANNERS; reach *= 2) {
        barrier();
        uint before = thread >= reach ? s_sum[thread - reach] : 0u;
        barrier();
        s_sum[thread] += before;
    }
    barrier();
    return s_sum[thread] - own;
}

void spawn(int parent, int unit, int child) {
    if (child >= u_most_blocks) {  // no room: the view is chosen again with more
        cell[UNITS * parent + unit] = NOTHING;
        return;
    }
    Block b = block_at(parent);
    cell[UNITS * parent + unit] = IS_BLOCK | uint(child);
    b_child[child - u_root_blocks] = Block(b.origin + (unit_at(unit) << b.unit_log2), b.unit_log2 - 3, b.root);
}

void main() {
    int thread = int(gl_LocalInvocationIndex), first = int(b_groups[u_round].w), n = int(b_groups[u_round].x);
    int stretch = (n + SCANNERS - 1) / SCANNERS, from = min(thread * stretch, n), end = min(from + stretch, n);
    uint units = 0u;
    for (int i = UNITS * (first + from); i < UNITS * (first + end); i++) units += cell[i] >> 31;
    int child = first + n + int(scan(thread, units));
    for (int i = UNITS * (first + from); i < UNITS * (first + end); i++)
        if ((cell[i] & IS_BLOCK) != 0u) spawn(i / UNITS, i % UNITS, child++);
    if (thread == 0) b_groups[u_round + 1] = uvec4(min(s_sum[SCANNERS - 1], uint(max(0, u_most_blocks - first - n))), 1, 1, first + n);
    if (thread == 0) b_groups[3].x = uint(min(first + n + int(s_sum[SCANNERS - 1]), u_most_blocks));  // groups of the passes that follow
    if (thread == 0) b_groups[3].w = max(b_groups[3].w, uint(first + n) + s_sum[SCANNERS - 1]);  // room that is needed
}
