// lod/rings/emit.comp — writes a patch for each leaf, at the place that lod/rings/place.comp computed. So the same view
//   always gives the same list. The records of hidden leaves come after all patches: measurements and explanations read
//   them, but nothing draws them. One thread handles one block.

#include "lod/rings/shapes.glsl"

layout(local_size_x = BLOCK_GROUP) in;

struct RingPatch {
    ivec2 corner;  // post; may lie beyond the map
    uint shape;
    float bound_px;
};
layout(std430, binding = 5) writeonly buffer Patches { RingPatch patches[]; };

uniform int u_most_patches;

void write_patch(uint place, RingPatch patch_) {
    // without room, the view is chosen again with larger buffers
    if (place < uint(u_most_patches)) patches[place] = patch_;
}

void write_hidden(ivec2 corner, uvec2 mine) {
    uint place = atomicAdd(s_written, 1u);
    for (int size = 0; size < SIZES; size++) place += s_count[size];
    write_patch(place, RingPatch(corner, mine.x, uintBitsToFloat(mine.y ^ HIDDEN)));
}

void main() {
    int b = int(gl_GlobalInvocationID.x);
    if (b >= blocks_in_all()) return;
    Block block = b_block[b];
    int first = plane(u_agreed) + UNITS * b;
    for (int unit = 0; unit < UNITS; unit++) {
        uint word = cell[first + unit];
        if (!is_leaf(word) || !begins_leaf(unit_at(unit), word)) continue;
        uvec2 mine = shape[UNITS * b + unit];
        ivec2 corner = block.origin + (unit_at(unit) << block.unit_log2);
        if ((mine.y & HIDDEN) != 0u) {
            write_hidden(corner, mine);
            continue;
        }
        uint place = s_offset[segments_log2_of(mine.x) * u_most_blocks + b]++;
        write_patch(place, RingPatch(corner, mine.x, uintBitsToFloat(mine.y)));
    }
}
