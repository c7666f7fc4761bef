// lod/tiles.glsl — tiles of TILE × TILE nodes of one level: what one work group turns into patches.
//   Patches come in seven sizes, by the segments T = 2^s of their sides; the size decides how many fit in a draw.
// Provides the lists that go from lod/tiles.comp through lod/patches.comp to the draw.

#include "lod/summary.glsl"

#define MANY 1024  // work groups in a row: more than 65535 in one dimension are not allowed

#define NO_GROUPS uvec4(0, 0, 1, 0)

layout(std430, binding = 2) buffer Active {
    uvec4 active_groups;  // dispatch size, and how many tiles
    uvec4 asking_groups;  // dispatch size of lod/agree.comp: the same, until that is over
    uint active_tile[];
};
layout(std430, binding = 3) buffer Offsets { uint offset[]; };  // patches of a size in a tile; then those before them

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
