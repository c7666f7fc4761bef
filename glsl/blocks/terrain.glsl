// blocks/terrain.glsl — the map for every stage: its posts, its quadtree, its heights.
//   A node of level j covers 2^j × 2^j cells from post (col, row) · 2^j on.
//   Corners beyond the last post are clamped to it.
//   Level 0 has the cells of the map; level u_top_level has one node over the whole map.
// Python twin: gpu.layout.TERRAIN. Heights are metres above the terrain's base; voids are filled from their rim.

struct Level {
    ivec2 size;         // nodes, columns and rows
    int first_node;     // first entry in node[], levels ≥ 1
    int first_word;     // first entry in split[], levels ≥ 1: one bit for each node, 32 nodes of a row in a word
    ivec2 tiles;        // tiles of 32 × 32 nodes, columns and rows
    int first_tile;     // first tile in the list of all levels' tiles
    int first_count;    // first word of this level's table of class counters
};

layout(std140, binding = 0) uniform Terrain {
    ivec2 u_last_post;     // column and row
    vec2 u_spacing_m;      // east, north
    int u_top_level;
    float u_low_m;         // low end of the quantisation range
    float u_span_m;        // width of the quantisation range
    int u_has_voids;
    // Where the narrow error classes begin; octaves of a class above them, of a narrow one, of one below.
    vec4 u_class_octaves;
    Level u_level[MAX_LEVELS];
};

layout(binding = 0) uniform sampler2D u_heights;
layout(binding = 1) uniform usampler2D u_marks;  // bits of posts

#define VOID 1u
#define WET 2u

#if defined(WINDOW)  // the window around a page (terrain_gl/pages/windows.py) takes the place of the map
float height_m(ivec2 post) { return texelFetch(u_heights, post, 0).x; }
#elif defined(PAGED)
#include "pages/pages.glsl"
#else
float height_m(ivec2 post) { return texelFetch(u_heights, post, 0).x; }
#endif

// By how much the height of a vertex between posts may be rounded:
// three interpolations in float32, each of them rounds twice.
float rounding_between_m() { return max(abs(u_low_m), abs(u_low_m + u_span_m)) * exp2(-22.0); }

// Mesa's software renderer fetches texels even in branches that are not taken. So maps without voids define NO_VOIDS.
#ifdef NO_VOIDS
bool is_void(ivec2 post) { return false; }
#else
bool is_void(ivec2 post) { return u_has_voids != 0 && (texelFetch(u_marks, post, 0).x & VOID) != 0u; }
#endif

// A full-resolution cell with a void corner is a hole.
bool is_hole(ivec2 cell) {
    if (u_has_voids == 0) return false;
    ivec2 next = min(cell + 1, u_last_post);
    return is_void(cell) || is_void(next) || is_void(ivec2(next.x, cell.y)) || is_void(ivec2(cell.x, next.y));
}
