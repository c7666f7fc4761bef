// lod/rings/emit.comp — writes a patch for each leaf, at the place that lod/rings/place.comp computed. So the same view
//   always gives the same list. The records of hidden leaves come after all patches: measurements and explanations read
//   them, but nothing draws them. One thread handles one block.

#include "lod/rings/shapes.glsl"

layout(local_size_x = BLOCK_GROUP) in;

layout(std430, binding = 6) writeonly buffer Patches { ivec4 patches[]; };  // mesh/shape.glsl

uniform int u_most_patches;

uint place_of_hidden() {
    uint place = atomicAdd(mesh_written, 1u);
    for (int size = 0; size < SIZES; size++) place += mesh_count[size];
    return place;
}

void main() {
    int b = int(gl_GlobalInvocationID.x);
    if (b >= blocks_in_all()) return;
    Block block = b_block[b];
    int first = plane(u_agreed) + UNITS * b;
    for (int unit = 0; unit < UNITS; unit++) {
        uint word = unit_word[first + unit];
        if (!is_leaf(word) || !begins_leaf(unit_at(unit), word)) continue;
        uvec2 mine = shape[UNITS * b + unit];
        ivec2 corner = block.origin + (unit_at(unit) << block.unit_log2);
        bool hidden = (mine.y & HIDDEN) != 0u;
        uint place = hidden ? place_of_hidden() : mesh_offset[segments_log2_of(mine.x) * u_most_blocks + b]++;
        if (place >= uint(u_most_patches)) continue;  // the view is chosen again with larger buffers
        patches[place] = ivec4(corner, mine.x, mine.y & ~HIDDEN);
    }
}
