// blocks/terrain.glsl — the map for every stage: its posts, its nodes, its heights.
//   A node of level j covers 2^j × 2^j cells from post (col, row) · 2^j on. Corners beyond the last post are clamped to
//   it. Level 0 has the cells of the map; level u_top_level has one node over the whole map (of a store, maybe more).
//   Heights are metres above the terrain's base; voids are filled from their rim.
// Provides height_m(), marks_at(), is_hole(), twist_m(), node_index(), unpack_range(), class_limit_m(),
// class_of_octave(), tile_log2().   Python twins: gpu.layout.TERRAIN, reference.twists, reference.class_limits

struct Level {
    ivec2 size;         // nodes, columns and rows
    int first_node;     // first record of this level in node[] and range[] (error/record.glsl), levels ≥ 1
    int first_count;    // first word of this level's table of class counters
    int first_page;     // of a store: first entry in its table of pages
};

layout(std140, binding = 0) uniform Terrain {
    ivec2 u_last_post;     // column and row
    vec2 u_spacing_m;      // east, north
    int u_top_level;
    float u_low_m;         // low end of the quantisation range
    float u_span_m;        // width of the quantisation range
    int u_has_voids;
    vec2 u_beyond_m;       // how far edits went below and above the quantisation range
    // x: octaves from the span down to the first narrow class; y, z, w: octaves of one class above the narrow classes,
    // of a narrow class, and of one class below the narrow classes
    vec4 u_class_octaves;
    Level u_level[MAX_LEVELS];
};

layout(binding = 0) uniform sampler2D u_heights;
layout(binding = 1) uniform usampler2D u_marks;  // VOID and WET; of pages also HOLE and HOLED

#define WEST 0  // edges of a node or patch, in gl_TessLevelOuter's order
#define NORTH 1
#define EAST 2
#define SOUTH 3

int node_index(int level, ivec2 at) { return u_level[level].first_node + at.y * u_level[level].size.x + at.x; }

float height_m(ivec2 post);

// If only some pages of the map are loaded, pages/terrain.glsl has these. With WINDOW, the window around a page
// (terrain_gl/pages/windows.py) takes the place of the map.
#if defined(WINDOW) || !defined(PAGED)
float height_m(ivec2 post) { return texelFetch(u_heights, post, 0).x; }
int range_index(int level, ivec2 at) { return node_index(level, at); }
int loaded_level(ivec2 low, ivec2 end, int from) { return from; }
uint marks_at(ivec2 post) { return texelFetch(u_marks, post, 0).x; }
#else
uint marks_at(ivec2 post);
#endif

// All heights lie between these two. So no error is larger than most_m().
float lowest_m() { return u_low_m - u_beyond_m.x; }
float highest_m() { return u_low_m + u_span_m + u_beyond_m.y; }
float most_m() { return u_span_m + (u_beyond_m.x + u_beyond_m.y); }

// What rounding adds to the error of a mesh with vertices between posts. Their heights are interpolated between two
// interpolated heights, and each rounds twice. The cell's twist adds 1/16 of that: docs/guarantee.md, section 7.
float rounding_between_m() { return max(abs(lowest_m()), abs(highest_m())) * (exp2(-22.0) + exp2(-26.0)); }

// Mesa's software renderer fetches texels even in branches that are not taken. So maps without voids define NO_VOIDS.
#ifdef NO_VOIDS
bool is_void(ivec2 post) { return false; }
bool is_hole(ivec2 cell) { return false; }
#else
bool is_void(ivec2 post) { return u_has_voids != 0 && (marks_at(post) & uint(VOID)) != 0u; }

// A full-resolution cell with a void corner is a hole.
bool is_hole(ivec2 cell) {
    if (u_has_voids == 0) return false;
#if defined(WINDOW) || !defined(PAGED)
    ivec2 next = min(cell + 1, u_last_post);
    return is_void(cell) || is_void(next) || is_void(ivec2(next.x, cell.y)) || is_void(ivec2(cell.x, next.y));
#else
    return (marks_at(cell) & uint(HOLE)) != 0u;
#endif
}
#endif

// The twist h00 − h10 − h01 + h11 of a cell: 0 if its posts lie in a plane. Differences of similar heights are exact,
// even if the heights are large (Sterbenz 1974, "Floating-point computation"). So `precise` forbids another order.
float twist_m(ivec2 cell) {
    ivec2 next = cell + 1;
    precise float north_m = height_m(cell) - height_m(ivec2(next.x, cell.y));
    precise float t = north_m - (height_m(ivec2(cell.x, next.y)) - height_m(next));
    return t;
}

// Lowest and highest height of a node, from a word of pack_range() (error/nodes.glsl): 16 bits each, the lowest low.
// In a node with voids, the two are exchanged. pack_range() makes them differ, so this needs no bit. The first and the
// last step also stand for all heights beyond the quantisation range.
vec2 unpack_range(uint range) {
    vec2 ends = vec2(range & 0xffffu, range >> 16);
    vec2 steps = vec2(min(ends.x, ends.y), max(ends.x, ends.y));
    vec2 beyond_m = vec2(-u_beyond_m.x, u_beyond_m.y) * vec2(equal(steps, vec2(0.0, 65535.0)));
    return steps / 65535.0 * u_span_m + u_low_m + beyond_m;
}

// --- Error classes: docs/guarantee.md, section 3 ---
//   A class is a limit of errors. For each class, a table counts the tiles with a larger error (error/bound.glsl).
//   Class 0 has the largest limit. Limits go down from the span; an octave is a factor of two. First come WIDE_CLASSES,
//   down to u_class_octaves.x octaves below the span. NARROW_CLASSES of an eighth of an octave each follow, then wide
//   ones again.

float class_limit_m(int c) {
    float above = min(float(c) + 1.0, float(WIDE_CLASSES));
    float rest = float(c) + 1.0 - above;
    float narrow = min(rest, float(NARROW_CLASSES));
    vec3 octaves = vec3(above, narrow, rest - narrow) * u_class_octaves.yzw;
    return u_span_m * exp2(-(octaves.x + octaves.y + octaves.z));
}

// The number, with a fraction, of the class whose limit is this many octaves below the span.
float class_of_octave(float octave) {
    float above = min(octave, u_class_octaves.x);
    float rest = octave - above;
    float narrow = min(rest, float(NARROW_CLASSES) * u_class_octaves.z);
    vec3 k = vec3(above, narrow, rest - narrow) / u_class_octaves.yzw;
    return k.x + k.y + k.z - 1.0;
}

// A tile is a square of nodes, the entry of a level's tables. This is log2 of its side in nodes. Level 0 has more nodes
// than all other levels together, so its tiles are larger.
int tile_log2(int level) { return level == 0 ? COUNT_TILE_LOG2 + 1 : COUNT_TILE_LOG2; }
#ifdef PAGED
#include "pages/terrain.glsl"
#endif
