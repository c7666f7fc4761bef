// lod/rings/lists.glsl — lists of leaves without gaps, so that all threads of a group have work.
//   A leaf's number is that of the unit at its north-west corner. One list holds every leaf once. Each round of
//   lod/rings/agree.comp has a list of its own, its queue.
// Provides list[], list_at(), append_leaves(), LEAF_GROUP.

#include "lod/rings/rings.glsl"

#define LEAF_GROUP 64  // leaves that one work group handles

// Four parts of UNITS * u_most_blocks words: all leaves; the queue of even rounds; that of odd rounds; a stamp for each
// leaf: the last round for which it was queued. All stamps of earlier views are lower than u_first_stamp.
layout(std430, binding = 5) buffer Lists { uint list[]; };

int list_at(int which) { return which * UNITS * u_most_blocks; }

// Append n leaves to the list of all leaves, which is also the queue of round 0; returns the place of the first one.
uint append_leaves(uint n) {
    uint k = atomicAdd(b_leaves.count, n), groups = (k + n + uint(LEAF_GROUP - 1)) / uint(LEAF_GROUP);
    atomicMax(b_leaves.groups, groups);
    atomicMax(b_queue[0].groups, groups);
    atomicAdd(b_queue[0].count, n);
    return k;
}
