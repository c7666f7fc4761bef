// lod/rings/spawn.comp — makes blocks of the units that decide.comp has marked. The blocks keep the order of the units,
//   so the same input gives the same blocks. One work group does it all; each thread owns one range of the round's
//   blocks.

#include "lod/rings/rings.glsl"
#include "lod/scan.glsl"

layout(local_size_x = SCANNERS) in;

uniform int u_round;  // the round of lod/rings/decide.comp that has just run

void spawn(int id, int child) {
    int known_log2 = step_log2_of(unit_word[plane(0) + id]);
    bool has_room = child < u_most_blocks;  // without room, the view is chosen again with larger buffers
    unit_word[plane(0) + id] = unit_word[plane(1) + id] = has_room ? IS_BLOCK | uint(child) : NOTHING;
    Block b = b_block[id / UNITS];
    ivec2 origin = b.origin + (unit_at(id % UNITS) << b.unit_log2);
    if (has_room) b_block[child] = Block(origin, b.unit_log2 - 3, b.ring, known_log2);
}

void main() {
    if (b_round[u_round + 1].groups == 0u) return;
    int thread = int(gl_LocalInvocationIndex), first = first_of_round(u_round), n = int(b_round[u_round].groups);
    int stretch = (n + SCANNERS - 1) / SCANNERS, from = min(thread * stretch, n), end = min(from + stretch, n);
    uint units = 0u;
    for (int id = UNITS * (first + from); id < UNITS * (first + end); id++) units += unit_word[id] >> 31;
    int child = first + n + int(sum_before(thread, units));
    for (int id = UNITS * (first + from); id < UNITS * (first + end); id++)
        if ((unit_word[id] & IS_BLOCK) != 0u) spawn(id, child++);
    if (thread > 0) return;
    int children = int(sum_of_all()), room = max(u_most_blocks - first - n, 0);
    b_round[u_round + 1] = Work(uint(min(children, room)), 1u, 1u, 0u);
    b_all.count = max(b_all.count, uint(first + n + children));
}
