// lod/quadtree/tiles.glsl — tiles of TILE × TILE nodes of one level; one work group turns a tile into patches.
//   Patches have seven sizes, T = 2^s segments a side. The size decides how many patches one draw takes.
// Provides the list that lod/quadtree/tiles.comp fills; tile_at(), offset_index().

#include "lod/quadtree/summary.glsl"

#define MANY 1024  // work groups along x: OpenGL allows at most 65535 in one dimension

layout(std430, binding = 2) buffer Active {
    uvec4 active_groups;  // dispatch size, and number of tiles
    uint active_tile[];
};

int tiles_in_all() {
    Level top = u_level[u_top_level];
    return top.first_tile + top.tiles.x * top.tiles.y;
}

// Column and row of a tile, and its level.
ivec3 tile_at(int tile) {
    int level = 0;
    while (level < u_top_level && tile >= u_level[level + 1].first_tile) level++;
    int i = tile - u_level[level].first_tile;
    return ivec3(i % u_level[level].tiles.x, i / u_level[level].tiles.x, level);
}

int offset_index(int size, int tile) { return size * tiles_in_all() + tile; }
