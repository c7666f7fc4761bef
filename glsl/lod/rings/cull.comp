// lod/rings/cull.comp — finds the blocks of the rings that lod/rings/decide.comp looks at. One thread handles one
//   block. A block that is outside the picture, beyond the map or wholly under the finer ring has no leaf: its units
//   become NOTHING here. So land that nobody sees costs one projection for each block, however large the map is.
// Python twin: reference.rings.cut_block

#include "lod/rings/squares.glsl"

layout(local_size_x = THREADS) in;

// Block number b of the rings, which are numbered ring after ring.
Block root_block(int b) {
    int r = 0;
    while (r + 1 < u_rings && b >= u_ring[r + 1].first_block) r++;
    Ring ring = u_ring[r];
    ivec2 at = ivec2((b - ring.first_block) % ring.blocks.x, (b - ring.first_block) / ring.blocks.x);
    return Block(ring.origin + at * (BLOCK_SIDE << ring.level), ring.level, r, NO_STEP);
}

bool has_leaf() {
    ivec2 end = block.origin + (BLOCK_SIDE << block.unit_log2);
    if (is_nothing(block.origin, end)) return false;
    return u_cull == 0 || !project_square(block.origin, side_log2_at(0)).outside;
}

void main() {
    int b = int(gl_GlobalInvocationID.x);
    if (b >= int(b_all.count)) return;
    take_block(root_block(b));
    b_block[b] = block;
    if (has_leaf()) {
        listed[atomicAdd(b_seen.groups, 1u)].seen_block = uint(b);
        return;
    }
    for (int id = UNITS * b; id < UNITS * b + UNITS; id++)
        unit_word[plane(0) + id] = unit_word[plane(1) + id] = NOTHING;
}
