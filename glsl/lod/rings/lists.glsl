// lod/rings/lists.glsl — lists of leaves without gaps, so that all threads of a group have work.
//   A leaf's number is that of the unit at its north-west corner. One list holds every leaf once. Each round of
//   lod/rings/agree.comp has a list of its own, its queue.
// Provides append_leaf(), append_leaves(), append_to_queue(), queued(), LEAF_GROUP.

#include "lod/rings/rings.glsl"

#define LEAF_GROUP 64  // leaves that one work group handles

// Four parts of UNITS * u_most_blocks words: all leaves; the queue of even rounds; that of odd rounds; a stamp for each leaf,
// which tells the last round that it was queued for. All stamps of earlier views are lower than u_first_stamp.
layout(std430, binding = 5) buffer Lists { uint list[]; };

int list_at(int which) { return which * UNITS * u_most_blocks; }

void append_leaf(int id) {
    uint k = atomicAdd(b_leaves.count, 1u);
    list[k] = uint(id);
    atomicMax(b_leaves.groups, k / uint(LEAF_GROUP) + 1u);
}

// The same for n leaves before round 0, whose queue is this list; returns the place of the first one.
uint append_leaves(uint n) {
    uint k = atomicAdd(b_leaves.count, n), groups = (k + n + uint(LEAF_GROUP - 1)) / uint(LEAF_GROUP);
    atomicMax(b_leaves.groups, groups);
    atomicMax(b_queue[0].groups, groups);
    atomicAdd(b_queue[0].count, n);
    return k;
}

// Queue a leaf for a round, at most once. The leaf may be split before the round begins. So the queue says which square the
// leaf covers now: the shape of its word, from `id` on.
void append_to_queue(int round_, int id, uint word) {
    uint stamp = u_first_stamp + uint(round_);
    if (atomicMax(list[list_at(3) + id], stamp) == stamp) return;
    uint k = atomicAdd(b_queue[round_ & 7].count, 1u);
    list[list_at(1 + (round_ & 1)) + k] = uint(id) | (word >> 8 & 3u) << 28;
    atomicMax(b_queue[round_ & 7].groups, k / uint(LEAF_GROUP) + 1u);
}

uint queued(int round_, uint k) { return list[(round_ > 0 ? list_at(1 + (round_ & 1)) : 0) + k]; }
int queued_id(uint entry) { return int(entry & 0xfffffffu); }
uint queued_shape(uint entry) { return entry >> 28 << 8; }  // as the word of a leaf has it
