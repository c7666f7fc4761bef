// lod/quadtree/tiles.comp — list the tiles that contain nodes of the view's tree. Nothing depends on the list's order.
//   One thread checks one tile.

#include "lod/quadtree/tree.glsl"
#include "lod/quadtree/tiles.glsl"

layout(local_size_x = GROUP) in;

// A tile of level j covers exactly one node of level j + log2 TILE.
// If that node is not split, no node of the tile exists.
bool has_nodes(int level, ivec2 tile) {
    int above = level + findMSB(TILE);
    if (above <= u_top_level && !is_split(above, tile)) return false;
    int end = min(TILE * (tile.y + 1), u_level[level].size.y);
    for (int row = TILE * tile.y; row < end; row += 2)  // siblings always exist together
        if (existing_word(level, tile.x, row) != 0u) return true;
    return false;
}

void main() {
    int tile = int(gl_GlobalInvocationID.x);
    if (tile >= tiles_in_all()) return;
    ivec3 at = tile_at(tile);
    for (int size = 0; size < SIZES; size++) s_offset[offset_index(size, tile)] = 0u;

    if (!has_nodes(at.z, at.xy)) return;
    uint place = atomicAdd(active_groups.w, 1u);
    active_tile[place] = uint(tile);
    uvec2 groups = uvec2(min(place + 1u, uint(MANY)), place / uint(MANY) + 1u);
    atomicMax(active_groups.x, groups.x);
    atomicMax(active_groups.y, groups.y);
}
