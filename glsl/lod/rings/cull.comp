// lod/rings/cull.comp — finds the blocks of the rings that lod/rings/decide.comp looks at. One thread handles one
//   block. A block that is outside the picture, beyond the map or wholly under the finer ring has no leaf: its units
//   become NOTHING here. So land that nobody sees costs one projection for each block, however large the map is.
// Python twin: reference.rings.cut_block

#include "lod/rings/squares.glsl"

layout(local_size_x = THREADS) in;

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
