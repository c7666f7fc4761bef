// rings/emit.comp — leaves to patches, each at its place: the same view gives the same list.
// A group is a block, a thread one of its units.

#include "rings/shapes.glsl"

layout(local_size_x = UNITS) in;

struct RingPatch {
    ivec2 corner;  // post; may lie beyond the map
    uint shape;
    float bound_px;
};
layout(std430, binding = 5) writeonly buffer Patches { RingPatch patches[]; };

uniform int u_most_patches;

shared uint s_shape[UNITS];

void main() {
    int unit = int(gl_LocalInvocationIndex), b = int(gl_WorkGroupID.x);
    if (b >= min(blocks_in_all(), u_most_blocks)) return;
    uvec2 mine = shape[UNITS * b + unit];
    s_shape[unit] = mine.x;
    barrier();
    if (mine.x == 0u) return;
    int size = segments_log2_of(mine.x);
    uint place = s_offset[size * u_most_blocks + b];
    for (int i = 0; i < unit; i++) if (s_shape[i] != 0u && segments_log2_of(s_shape[i]) == size) place++;
    if (place >= uint(u_most_patches)) return;  // no room: the view is chosen again with more
    Block block = block_at(b);
    patches[place] = RingPatch(block.origin + (unit_at(unit) << block.unit_log2), mine.x, uintBitsToFloat(mine.y));
}
