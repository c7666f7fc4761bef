// lod/rings/emit.comp — writes a patch for each leaf, at the place that lod/rings/place.comp computed. So the same view
//   always gives
// the same list. One thread handles one block.

#include "lod/rings/shapes.glsl"

layout(local_size_x = BLOCK_GROUP) in;

struct RingPatch {
    ivec2 corner;  // post; may lie beyond the map
    uint shape;
    float bound_px;
};
layout(std430, binding = 5) writeonly buffer Patches { RingPatch patches[]; };

uniform int u_most_patches;

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
        uint place = s_offset[segments_log2_of(mine.x) * u_most_blocks + b]++;
        if (place < uint(u_most_patches))  // without room, the view is chosen again with larger buffers
            patches[place] = RingPatch(corner, mine.x, uintBitsToFloat(mine.y));
    }
}
