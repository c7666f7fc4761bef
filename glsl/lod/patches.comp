// lod/patches.comp — from the tree's leaves to patches: a leaf is drawn as
//   a quad, two triangles, if its error as a quad is within the tolerance and no neighbour is finer,
//   a fan of 4 to 8 triangles around its centre otherwise, each edge split where the neighbour is finer;
// and 2 × 2, 4 × 4, ... 32 × 32 quads that fill a square become one patch, if the summed-area tables, asked for the
// patch as a whole, hold it within the tolerance:
//
//     1 1 1 1 │ 1 1         1s: quads; F: fans              a square's bits are joined in steps:
//     1 1 1 1 │ 1 F            ┌───────┐                        row & row >> 1     two side by side
//     1 1 1 1 │ F F     →      │ T = 4 │ T=2 ...                & the row below    two on two
//     1 1 1 1 │ 1 1            └───────┘
//
// Run twice: to count (EMIT 0), and to write each patch at its place (EMIT 1). A group of 32 × 8 threads is a tile.

#include "lod/tree.glsl"
#include "lod/tiles.glsl"
#include "error/bound.glsl"

#ifndef EMIT
#define EMIT 0
#endif

layout(local_size_x = 32, local_size_y = 8) in;
layout(std430, binding = 5) writeonly buffer Patches { uvec2 patches[]; };

shared uint s_squares[SIZES][TILE];  // bit: north-west node of a square of quads
shared uint s_fans[TILE];
shared uint s_tile_triangles, s_tile_splits, s_tile_worst;

int level;
ivec2 first;  // the tile's north-west node

// Bits of the edges at which the neighbour is finer: west, north, east, south, as gl_TessLevelOuter has them.
uint finer_neighbours(ivec2 at) {
    return uint(is_split(level, at - ivec2(1, 0))) | uint(is_split(level, at - ivec2(0, 1))) << 1 |
           uint(is_split(level, at + ivec2(1, 0))) << 2 | uint(is_split(level, at + ivec2(0, 1))) << 3;
}

// Past the map's last post a fan has no halves of edges and no wedge.
uint fan_triangles(ivec2 at, uint edges) {
    bvec2 clamped = greaterThanEqual((2 * at + 1) << (level - 1), u_last_post);
    return 4u + bitCount(edges) - uint(clamped.x) - uint(clamped.y);
}

uint fan_edges(ivec2 at) {
    bvec2 clamped = greaterThanEqual((2 * at + 1) << (level - 1), u_last_post);
    return finer_neighbours(at) & ~(clamped.x ? 10u : 0u) & ~(clamped.y ? 5u : 0u);
}

void classify(ivec2 in_tile) {
    ivec2 at = first + in_tile;
    if (!exists(level, at)) return;
    if (is_split(level, at)) {
        atomicAdd(s_tile_splits, 1u);
        return;
    }
    Projection p = project_node(level, at, 1.0);
    if (u_cull != 0 && p.outside) return;
    uint bit = 1u << in_tile.x;
    if (level == 0) {
        atomicOr(s_squares[0][in_tile.y], bit);
        return;
    }
    PackedNode n = node_of(level, at);
    float px = p.outside ? 0.0 : quad_px(p, n);
    if (finer_neighbours(at) == 0u && px <= u_tolerance_px) atomicOr(s_squares[0][in_tile.y], bit);
    else {
        atomicOr(s_fans[in_tile.y], bit);
        atomicAdd(s_tile_triangles, fan_triangles(at, fan_edges(at)));
        px = p.outside ? 0.0 : fan_px(p, n);
    }
    atomicMax(s_tile_worst, floatBitsToUint(px));
}

// Two by two quads are their own four records; larger squares ask the summed-area tables.
vec2 square_errors_m(int size, ivec2 at) {
    if (size > 1) return vec2(bound_max_m(level, at, 1 << size), bound_rms_m(level, at, 1 << size));
    vec2 worst = vec2(0.0);
    for (int i = 0; i < 4; i++) {
        PackedNode n = node_of(level, at + ivec2(i & 1, i >> 1));
        worst = max(worst, vec2(unpack_pair(n.max_m).x, unpack_pair(n.rms_m).x));
    }
    return worst;
}

bool certified(int size, ivec2 at) {
    ivec2 low = at << level, high = (at + (1 << size)) << level;
    if (any(greaterThan(high, u_last_post))) return false;
    if (level == 0) return true;
    vec2 range_m = unpack_range(node_of(level + size, at >> size).range), errors_m = square_errors_m(size, at);
    Projection p = project(box_of(low, high, range_m), 1.0);
    return p.outside || metric_px(p, errors_m.x, errors_m.y) <= u_tolerance_px;
}

// Row `row` of squares of size s from those of size s - 1: only every 2^s-th row and bit can begin one.
uint join_squares(int s, int row) {
    int half_side = 1 << (s - 1);
    if ((row & (2 * half_side - 1)) != 0 || level + s > u_top_level) return 0u;
    uint north = s_squares[s - 1][row], south = s_squares[s - 1][row + half_side];
    uint joined = 0u;
    for (uint left = north & north >> half_side & south & south >> half_side; left != 0u; left &= left - 1u) {
        int column = findLSB(left);
        if ((column & (2 * half_side - 1)) == 0 && certified(s, first + ivec2(column, row))) joined |= 1u << column;
    }
    return joined;
}

void form_squares(int row) {
    for (int s = 1; s < SIZES; s++) {
        barrier();
        uint joined = row < TILE ? join_squares(s, row) : 0u;
        barrier();
        if (row < TILE) s_squares[s][row] = joined;
        if (joined == 0u) continue;
        int half_side = 1 << (s - 1);
        uint parts = joined | joined << half_side;
        s_squares[s - 1][row] &= ~parts;
        s_squares[s - 1][row + half_side] &= ~parts;
    }
    barrier();
}

// Fans have two segments a side: they are drawn with the squares of that size.
uint patch_bits(int s, int row) { return s_squares[s][row] | (s == 1 ? s_fans[row] : 0u); }

uint patches_before(int s, int row) {
    uint n = 0u;
    for (int r = 0; r < row; r++) n += bitCount(patch_bits(s, r));
    return n;
}

void count_patches(int tile, int s) {
    uint squares = 0u, fans = 0u;
    for (int row = 0; row < TILE; row++) {
        squares += bitCount(s_squares[s][row]);
        if (s == 1) fans += bitCount(s_fans[row]);
    }
    offset[offset_index(s, tile)] = squares + fans;
    atomicAdd(s_count[s], squares + fans);
    atomicAdd(s_tile_triangles, squares * (2u << 2 * s));
}

void add_to_summary() {
    atomicAdd(s_triangles, s_tile_triangles);
    atomicAdd(s_splits, s_tile_splits);
    atomicMax(s_worst_px, s_tile_worst);
}

void write_patches(int tile, int s, int row) {
    uint place = offset[offset_index(s, tile)] + patches_before(s, row);
    for (uint left = patch_bits(s, row); left != 0u; left &= left - 1u) {
        ivec2 at = first + ivec2(findLSB(left), row);
        ivec2 corner = at << level;
        bool fan = s == 1 && (s_fans[row] & left & -left) != 0u;
        uint step_log2 = uint(fan ? level - 1 : level), edges = fan ? fan_edges(at) : 15u;
        patches[place++] = uvec2(uint(corner.x) | uint(corner.y) << 16,
                                 step_log2 | uint(s) << 4 | edges << 8 | uint(fan) << 12);
    }
}

void main() {
    uint group = gl_WorkGroupID.y * uint(MANY) + gl_WorkGroupID.x;
    if (group >= active_groups.w) return;
    int tile = int(active_tile[group]), thread = int(gl_LocalInvocationIndex);
    level = 0;
    while (level < u_top_level && tile >= u_level[level + 1].first_tile) level++;
    int i = tile - u_level[level].first_tile;
    first = TILE * ivec2(i % u_level[level].tiles.x, i / u_level[level].tiles.x);

    if (thread < TILE) s_squares[0][thread] = s_fans[thread] = 0u;
    if (thread == 0) s_tile_triangles = s_tile_splits = s_tile_worst = 0u;
    barrier();
    for (int row = int(gl_LocalInvocationID.y); row < TILE; row += 8) classify(ivec2(gl_LocalInvocationID.x, row));
    form_squares(thread);
#if EMIT
    if (thread < TILE)
        for (int s = 0; s < SIZES; s++) write_patches(tile, s, thread);
#else
    if (thread < SIZES) count_patches(tile, thread);
    barrier();
    if (thread == 0) add_to_summary();
#endif
}
