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
// Run twice, by one program so that both decide alike: to count, and with u_emit to write each patch at its place. A group of 32 threads is a tile, a thread
// one of its rows.

#include "lod/tree.glsl"
#include "lod/tiles.glsl"
#include "error/bound.glsl"

layout(local_size_x = TILE) in;
layout(std430, binding = 5) writeonly buffer Patches { uvec2 patches[]; };

uniform bool u_emit;

shared uint s_squares[SIZES][TILE];  // a bit for each north-west node of a square of quads
shared uint s_fans[TILE];
shared uint s_tile_triangles, s_tile_splits, s_tile_worst;

int level;
ivec2 first;  // the tile's north-west node
int row;      // this thread's, in the tile

// Which of the row's nodes have finer neighbours to the west, north, east and south: gl_TessLevelOuter's order.
uvec4 finer_neighbours() {
    int word = first.x / TILE, y = first.y + row;
    uint own = split_word(level, word, y);
    return uvec4(own << 1 | split_word(level, word - 1, y) >> 31, split_word(level, word, y - 1),
                 own >> 1 | split_word(level, word + 1, y) << 31, split_word(level, word, y + 1));
}

// Whether a fan's centre lies on the map's last column, and on its last row.
bvec2 on_rim(int column) {
    return greaterThanEqual((2 * (first + ivec2(column, row)) + 1) << (level - 1), u_last_post);
}

// A fan's edges that are split. Where its centre lies on the map's rim, edges end at their middle and stay whole.
uint split_edges(uvec4 finer, int column) {
    uvec4 bits = finer >> column & 1u;
    bvec2 rim = on_rim(column);
    if (rim.x) bits.yw = uvec2(0u);
    if (rim.y) bits.xz = uvec2(0u);
    return bits.x | bits.y << 1 | bits.z << 2 | bits.w << 3;
}

// On the rim, the wedges beyond it have no area.
uint fan_triangles(uint edges, int column) {
    bvec2 rim = on_rim(column);
    return 4u + uint(bitCount(edges)) - uint(rim.x) - uint(rim.y);
}

void classify_row() {
    int word = first.x / TILE, y = first.y + row;
    if (y >= u_level[level].size.y) return;
    uint split_here = split_word(level, word, y), squares = 0u, fans = 0u, triangles = 0u;
    uvec4 finer = finer_neighbours();
    uint crowded = finer.x | finer.y | finer.z | finer.w;
    float worst_px = 0.0;
    for (uint left = existing_word(level, word, y) & ~split_here; left != 0u; left &= left - 1u) {
        int column = findLSB(left);
        ivec2 at = first + ivec2(column, row);
        Projection p = project_node(level, at, 1.0);
        if (u_cull != 0 && p.outside) continue;
        if (level == 0) {
            squares |= 1u << column;
            continue;
        }
        PackedNode n = node_of(level, at);
        float px = p.outside ? 0.0 : quad_px(p, n);
        if ((crowded >> column & 1u) == 0u && px <= u_tolerance_px) squares |= 1u << column;
        else {
            fans |= 1u << column;
            triangles += fan_triangles(split_edges(finer, column), column);
            px = p.outside ? 0.0 : fan_px(p, n);
        }
        worst_px = max(worst_px, px);
    }
    s_squares[0][row] = squares;
    s_fans[row] = fans;
    atomicAdd(s_tile_triangles, triangles);
    atomicAdd(s_tile_splits, uint(bitCount(split_here)));
    atomicMax(s_tile_worst, floatBitsToUint(worst_px));
}

// Two by two quads are their own four records; larger squares ask the summed-area tables.
vec2 square_errors_m(int size, ivec2 at) {
    if (size > 1) {
        float max_m = bound_max_m(level, at, 1 << size);
        return vec2(max_m, mean_is_known(node_of(level + size, at >> size)) ? bound_rms_m(level, at, 1 << size) : max_m);
    }
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

// This row's squares of size s, from those of size s - 1: only every 2^s-th row and bit can begin one.
uint join_squares(int s) {
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

void form_squares() {
    for (int s = 1; s < SIZES; s++) {
        uint joined = join_squares(s);
        barrier();
        s_squares[s][row] = joined;
        if (joined != 0u) {
            int half_side = 1 << (s - 1);
            uint parts = joined | joined << half_side;
            s_squares[s - 1][row] &= ~parts;
            s_squares[s - 1][row + half_side] &= ~parts;
        }
        barrier();
    }
}

// Fans have two segments a side: they are drawn with the squares of that size.
uint patch_bits(int s, int row) { return s_squares[s][row] | (s == 1 ? s_fans[row] : 0u); }

void count_patches(int tile, int s) {
    uint squares = 0u, fans = 0u;
    for (int r = 0; r < TILE; r++) {
        squares += uint(bitCount(s_squares[s][r]));
        if (s == 1) fans += uint(bitCount(s_fans[r]));
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

void write_row(int tile, int s) {
    if (patch_bits(s, row) == 0u) return;
    uint place = offset[offset_index(s, tile)];
    for (int r = 0; r < row; r++) place += uint(bitCount(patch_bits(s, r)));
    uvec4 finer = finer_neighbours();
    for (uint left = patch_bits(s, row); left != 0u; left &= left - 1u) {
        int column = findLSB(left);
        ivec2 corner = (first + ivec2(column, row)) << level;
        bool fan = s == 1 && (s_fans[row] >> column & 1u) != 0u;
        uint step_log2 = uint(fan ? level - 1 : level), edges = fan ? split_edges(finer, column) : 15u;
        patches[place++] = uvec2(uint(corner.x) | uint(corner.y) << 16,
                                 step_log2 | uint(s) << 4 | edges << 8 | uint(fan) << 12);
    }
}

void main() {
    uint group = gl_WorkGroupID.y * uint(MANY) + gl_WorkGroupID.x;
    if (group >= active_groups.w) return;
    int tile = int(active_tile[group]);
    ivec3 at = tile_at(tile);
    level = at.z;
    first = TILE * at.xy;
    row = int(gl_LocalInvocationIndex);

    s_squares[0][row] = s_fans[row] = 0u;
    if (row == 0) s_tile_triangles = s_tile_splits = s_tile_worst = 0u;
    barrier();
    classify_row();
    barrier();
    form_squares();
    if (u_emit) {
        for (int s = 0; s < SIZES; s++) write_row(tile, s);
        return;
    }
    if (row < SIZES) count_patches(tile, row);
    barrier();
    if (row == 0) add_to_summary();
}
