// lod/rings/rings.glsl — a clipmap around the eye, and the patches that it is cut into.
//   Ring l has cells of 2^l posts. It is a rectangle of blocks of BLOCK_SIDE × BLOCK_SIDE ring cells, and the next
//   finer ring fills its middle. A ring follows the eye in steps of four of its cells. So its blocks need not be nodes
//   of the error tables' tree.
//   A block is divided into units of one ring cell. A leaf is a square of 8, 4, 2 or 1 units a side. It becomes one
//   patch. If a unit needs 8 segments a side or more, it becomes a block of its own, with units an eighth as large.
//
//        block, 8 × 8 units                 a ring of blocks, and the finer ring in its middle
//       ┌───────┬───┬───┐                        ┌────┬────┬────┬────┐
//       │       │   │   │                        │    │    │    │    │
//       │  4×4  ├───┼─┬─┤                        ├────┼─┬─┬┴┬─┬─┼────┤
//       │       │   ├─┼─┤                        │    ├─┼─┼─┼─┼─┤    │
//       ├───┬───┼───┴─┴─┤                        ├────┼─┴─┴─┴─┴─┼────┤
//
// Provides the rings, the blocks, the words of units, and the list of all leaves.
// Python twins: gpu.layout.RINGS, reference.rings.ring_origin

#include "blocks/view.glsl"

#define BLOCK_SIDE 8      // units along a block's side; UNITS and SQUARES follow from it
#define UNITS 64          // units of a block
#define SQUARES 85        // squares of 8, 4, 2 and 1 units in a block: 1 + 4 + 16 + 64
#define MOST_SEGMENTS_LOG2 6  // OpenGL's 64
#ifndef THREADS
#define THREADS 64  // threads that the hardware runs at the same time (lod/rings.py)
#endif
#define FINEST -5         // log2 of the smallest spacing: 32 segments between two posts

struct Ring {
    ivec2 origin;   // post of the north-west corner
    ivec2 blocks;   // columns and rows of blocks
    int level;      // l
    int first_block;
};

layout(std140, binding = 2) uniform Rings {
    int u_rings;        // number of rings; u_ring begins with the finest
    int u_most_blocks;  // blocks that the buffers have room for
    uint u_first_stamp; // stamp of this view's first round
    Ring u_ring[MAX_LEVELS];
};

struct Block {
    ivec2 origin;
    int unit_log2;  // posts a side of a unit
    int ring;       // index of the ring that it lies in
    int known_log2; // log2 of a spacing that the tables allow in the whole block, or NO_STEP
};

#define NO_STEP 47  // a unit's word stores a spacing + 16 in six bits, and 63 is the last
struct Work {
    uint groups, one_y, one_z;  // the command of an indirect dispatch
    uint count;                 // leaves or blocks that the dispatch handles
};

layout(std430, binding = 0) buffer Blocks {
    Work b_round[3];  // blocks of each round of lod/rings/decide.comp, one a group; `count` is not used
    Work b_seen;      // blocks of the rings that may have a leaf: lod/rings/cull.comp; likewise
    Work b_all;       // blocks of all rounds; `count` may exceed u_most_blocks: then the view is chosen again
    Work b_leaves;    // all leaves: lod/rings/count.comp
    // Leaves that round r of lod/rings/agree.comp handles, at index r modulo 8. Counts must be 0 before the round: the
    // host clears all of them for each view, and those of past rounds if there are more than 8 rounds.
    Work b_queue[8];
    Block b_block[];
};
// A word for each unit of each block: leaf, block, or nothing. There are two copies, the planes. Round r of
// lod/rings/agree.comp reads plane r modulo 2 and writes the other. They differ only where the round before changed it.
layout(std430, binding = 1) buffer Units { uint unit_word[]; };

uniform int u_agreed;  // finished rounds of lod/rings/agree.comp

int plane(int round_) { return (round_ & 1) * UNITS * u_most_blocks; }
int first_of_round(int r) { return int((r > 0 ? b_round[0].groups : 0u) + (r > 1 ? b_round[1].groups : 0u)); }
int blocks_in_all() { return min(int(b_all.count), u_most_blocks); }

// A leaf's word: log2 of its side in units, and log2 of the posts between its vertices.
// IS_BROKEN: the tables prove no bound within the tolerance.
#define NOTHING 0u
#define IS_BLOCK 0x80000000u
#define IS_LEAF 0x40000000u
#define IS_BROKEN 0x20000000u

uint leaf_word(int side_log2, int step_log2) { return IS_LEAF | uint(side_log2) << 8 | uint(step_log2 + 16); }
int side_units_log2(uint word) { return int(word >> 8 & 3u); }
int step_log2_of(uint word) { return int(word & 63u) - 16; }

// A single cell of the map with two segments a side is a fan of four triangles: the edges of a cell are straight, so
// they need no vertex in their middle. Where a neighbour is finer, the edge has the neighbour's vertices.
bool is_cell_fan(int side_log2, int step_log2) { return side_log2 == 0 && step_log2 == -1; }
bool is_leaf(uint word) { return (word & IS_LEAF) != 0u; }

ivec2 unit_at(int unit) { return ivec2(unit & 7, unit >> 3); }
ivec2 ring_end(Ring ring) { return ring.origin + ring.blocks * (BLOCK_SIDE << ring.level); }

bool begins_leaf(ivec2 unit, uint word) { return all(equal(unit & (1 << side_units_log2(word)) - 1, ivec2(0))); }

// --- A list of leaves without gaps, so that all threads of a group have work ---
//   A leaf's number is that of the unit at its north-west corner. The list has every leaf once. Each round of
//   lod/rings/agree.comp has a list of its own, its queue.
#define LEAF_GROUP 64  // leaves that one work group handles

// Element i of five lists, which stand in one block: OpenGL 4.3 guarantees only 8 storage blocks for a pass.
struct Listed {
    uint leaf;         // list of all leaves
    uint in_queue[2];  // queues of even and odd rounds of lod/rings/agree.comp; that of round 0 is the list of leaves
    uint stamp;        // of the leaf with the number i: lod/rings/agree.comp
    uint seen_block;   // blocks that may have a leaf: lod/rings/cull.comp
};
layout(std430, binding = 5) buffer Lists { Listed listed[]; };

// Append n leaves to the list of leaves, which is also the queue of round 0; returns the place of the first one.
uint append_leaves(uint n) {
    uint k = atomicAdd(b_leaves.count, n), groups = (k + n + uint(LEAF_GROUP - 1)) / uint(LEAF_GROUP);
    atomicMax(b_leaves.groups, groups);
    atomicMax(b_queue[0].groups, groups);
    atomicAdd(b_queue[0].count, n);
    return k;
}
