// rings/lists.glsl — leaves side by side, so that neighbouring threads all have work.
//   A leaf is named by the unit of its north-west corner. All leaves stand in one list, each once; a round of
//   rings/settle.comp has a list of its own, its queue.
// Provides append_leaf(), append_to_queue(), queued(), LEAF_GROUP.

#include "rings/rings.glsl"

#define LEAF_GROUP 64  // leaves of a work group

// UNITS * u_most_blocks words each: all leaves, the queues of even and of odd rounds, and the last round that queued a leaf.
layout(std430, binding = 5) buffer Lists { uint list[]; };

uniform uint u_first_stamp;  // of this view's rounds: stamps of other views are lower

int list_at(int which) { return which * UNITS * u_most_blocks; }

void append_leaf(int id) {
    uint k = atomicAdd(b_leaves.count, 1u);
    list[k] = uint(id);
    atomicMax(b_leaves.groups, k / uint(LEAF_GROUP) + 1u);
}

// Queue a leaf for a round, at most once. The round looks at the square of 2^units_log2 units from `id` on; by then the leaf
// may have been split.
void append_to_queue(int round_, int id, int units_log2) {
    uint stamp = u_first_stamp + uint(round_);
    if (atomicMax(list[list_at(3) + id], stamp) == stamp) return;
    uint k = atomicAdd(b_queue[round_ & 7].count, 1u);
    list[list_at(1 + (round_ & 1)) + k] = uint(id) | uint(units_log2) << 28;
    atomicMax(b_queue[round_ & 7].groups, k / uint(LEAF_GROUP) + 1u);
}

uint queued(int round_, uint k) { return list[list_at(1 + (round_ & 1)) + k]; }
int queued_id(uint entry) { return int(entry & 0xfffffffu); }
int queued_units_log2(uint entry) { return int(entry >> 28); }
