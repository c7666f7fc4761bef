// rings/rings.glsl — a clipmap around the eye, and the patches that it is cut into.
//   Ring l stands on the lattice of 2^l posts. It is a rectangle of patches, PATCH × PATCH ring cells each, and the next
//   finer ring fills its middle. A ring begins at an even place of its lattice, wherever the eye puts it: so its patches
//   are no nodes of the error tables' tree.
//   A block is a patch, cut into units of one ring cell. Squares of 8, 4, 2 or 1 units are drawn in one piece, a leaf.
//   A unit that 64 segments cannot hold becomes a block of its own, with units an eighth as large.
//
//        block, 8 × 8 units                 a ring of blocks, and the finer ring in its middle
//       ┌───────┬───┬───┐                        ┌────┬────┬────┬────┐
//       │       │   │   │                        │    │    │    │    │
//       │  4×4  ├───┼─┬─┤                        ├────┼─┬─┬┴┬─┬─┼────┤
//       │       │   ├─┼─┤                        │    ├─┼─┼─┼─┼─┤    │
//       ├───┬───┼───┴─┴─┤                        ├────┼─┴─┴─┴─┴─┼────┤
//       │   │   │       │
//
// Provides the rings, blocks and leaves of a view, and leaf_over().   Python twins: gpu.layout.RINGS, reference.clipmap.ring_origin

#include "blocks/view.glsl"

#define PATCH 8           // ring cells a side: the numbers below follow from it
#define UNITS 64          // units of a block
#ifndef THREADS
#define THREADS 64       // of a block's group: as many as the hardware runs side by side (lod/clipmap.py)
#endif
#define SQUARES 85        // squares of 8, 4, 2 and 1 units in a block: 1 + 4 + 16 + 64
#define MOST_SEGMENTS_LOG2 6  // OpenGL's 64
#define FINEST -5         // log2 of the least spacing: 32 segments between two posts

struct Ring {
    ivec2 origin;   // post of the north-west corner
    ivec2 patches;  // columns and rows of blocks
    int level;      // l
    int first_block;
};

layout(std140, binding = 2) uniform Rings {
    int u_rings;        // finest first
    int u_root_blocks;  // of all rings; blocks of single units follow
    int u_most_blocks;  // for which there is room
    Ring u_ring[MAX_LEVELS];
};

struct Block {
    ivec2 origin;
    int unit_log2;  // posts a side of a unit
    int root;       // the ring's block that it lies in
};

layout(std430, binding = 0) buffer Blocks {
    uvec4 b_groups[4];  // dispatch size of each round of rings/decide.comp: so many blocks; w: the first of them. At last
                        // that of all blocks; w: how many there should be room for
    Block b_child[];    // those after the rings' own
};
layout(std430, binding = 1) buffer Cells { uint cell[]; };  // of each unit of each block: a leaf, a block, or nothing

// A leaf: log2 of its side in units, log2 of the posts between its vertices, and whether the tables hold it within the
// tolerance.
#define NOTHING 0u
#define IS_BLOCK 0x80000000u
#define IS_LEAF 0x40000000u
#define IS_BROKEN 0x20000000u

uint leaf_word(int side_log2, int step_log2) { return IS_LEAF | uint(side_log2) << 8 | uint(step_log2 + 16); }
int side_units_log2(uint word) { return int(word >> 8 & 3u); }
int step_log2_of(uint word) { return int(word & 63u) - 16; }
bool is_leaf(uint word) { return (word & IS_LEAF) != 0u; }

int blocks_in_all() { return int(b_groups[2].w + b_groups[2].x); }

int ring_of(int root) {
    int r = 0;
    while (r + 1 < u_rings && root >= u_ring[r + 1].first_block) r++;
    return r;
}

Block block_at(int i) {
    if (i >= u_root_blocks) return b_child[i - u_root_blocks];
    int r = ring_of(i);
    Ring ring = u_ring[r];
    int k = i - ring.first_block;
    ivec2 at = ivec2(k % ring.patches.x, k / ring.patches.x);
    return Block(ring.origin + at * (PATCH << ring.level), ring.level, i);
}

ivec2 unit_at(int unit) { return ivec2(unit & 7, unit >> 3); }

// Posts where a ring begins and ends.
ivec2 ring_end(Ring ring) { return ring.origin + ring.patches * (PATCH << ring.level); }

bool is_within(ivec2 post, ivec2 low, ivec2 end) {
    return all(greaterThanEqual(post, low)) && all(lessThan(post, end));
}

// A leaf, and where it is.
struct Leaf {
    uint word;
    ivec2 origin;
    int side_log2;  // posts
};

const Leaf NO_LEAF = Leaf(NOTHING, ivec2(-1 << 28), 0);

int near_ring;  // where leaf_over() begins to look: a neighbour of a ring's leaf lies in it, or in one of the two next to it

// The leaf over the map's cell south-east of a post.
Leaf leaf_over(ivec2 post) {
    int r = max(near_ring - 1, 0);
    while (r < u_rings && !is_within(post, u_ring[r].origin, ring_end(u_ring[r]))) r++;
    if (r == u_rings) return NO_LEAF;
    Ring ring = u_ring[r];
    ivec2 in_ring = post - ring.origin, at = in_ring >> (ring.level + 3);
    int block = ring.first_block + at.y * ring.patches.x + at.x, unit_log2 = ring.level;
    ivec2 in_block = in_ring - (at << (ring.level + 3)), unit = in_block >> unit_log2;
    uint word = cell[UNITS * block + unit.y * 8 + unit.x];
    while ((word & IS_BLOCK) != 0u) {
        in_block -= unit << unit_log2;
        unit_log2 -= 3;
        unit = in_block >> unit_log2;
        word = cell[UNITS * int(word & ~IS_BLOCK) + unit.y * 8 + unit.x];
    }
    int side_log2 = unit_log2 + side_units_log2(word);
    ivec2 in_leaf = in_block - (unit >> side_units_log2(word) << side_log2);
    return Leaf(word, post - in_leaf, side_log2);
}
