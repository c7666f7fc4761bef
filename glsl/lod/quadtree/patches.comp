// lod/quadtree/patches.comp — from the tree's leaves to patches: quads and fans (lod/quadtree/leaf.glsl);
//   quads are joined to squares (lod/quadtree/squares.glsl). The program runs twice: to count the patches, and to write
//   them. A group of 32 threads processes one tile, each thread one of its rows.
// Python twin: reference.select

#include "lod/quadtree/leaf.glsl"
#include "lod/quadtree/squares.glsl"
#include "mesh/shape.glsl"
#include "lod/quadtree/cell.glsl"

layout(local_size_x = TILE) in;
layout(std430, binding = 5) writeonly buffer Patches { ivec4 patches[]; };

uniform bool u_emits;  // write the patches, and do not count them

// Fans, which count as two segments; and cells of the map that are cut in 2^size parts a side.
shared uint s_fans[SIZES][TILE];
shared uint s_tile_triangles, s_tile_splits, s_tile_worst;

int level;
ivec2 first;  // the tile's north-west node
int row;      // this thread's row in the tile

int segments_of_cell(Projection p, ivec2 cell) {
    if (has_budget()) return cell_fan_pays(p, cell) ? 1 : 0;
    return u_tolerance_px > 0.0 ? cell_segments_log2(p, cell) : 0;
}

void classify_row() {
    int word = first.x / TILE, y = first.y + row;
    if (y >= u_level[level].size.y) return;
    uint split_here = split_word(level, word, y), squares = 0u, fans = 0u, triangles = 0u;
    uvec4 finer = finer_neighbours(level, word, y);
    uint crowded = finer.x | finer.y | finer.z | finer.w;
    float worst_px = 0.0;
    for (uint left = existing_word(level, word, y) & ~split_here; left != 0u; left &= left - 1u) {
        int column = findLSB(left);
        ivec2 at = first + ivec2(column, row);
        Projection p = project_node(level, at, 1.0);
        if (u_cull != 0 && p.outside) continue;
        if (level == 0) {
            int size = segments_of_cell(p, at);
            if (size == 0) squares |= 1u << column;
            else {
                s_fans[size][row] |= 1u << column;
                triangles += cell_triangles(size);
            }
            if (!p.outside && !is_hole(at)) worst_px = max(worst_px, cell_px(p, twist_m(at), size));
            continue;
        }
        PackedNode n = node_of(level, at);
        uint edges = split_edges(finer, level, at);
        bool quad = (crowded >> column & 1u) == 0u && draws_as_quad(p, n, level, at);
        if (quad) squares |= 1u << column;
        else {
            fans |= 1u << column;
            triangles += fan_triangles(edges, level, at);
        }
        if (!p.outside) worst_px = max(worst_px, quad ? quad_px(p, n) : fan_px(p, n, edges));
    }
    s_squares[0][row] = squares;
    if (level > 0) s_fans[1][row] = fans;
    atomicAdd(s_tile_triangles, triangles + 2u * uint(bitCount(squares)));
    atomicAdd(s_tile_splits, uint(bitCount(split_here)));
    atomicMax(s_tile_worst, floatBitsToUint(worst_px));
}

// Fans are drawn together with squares of the same number of segments.
uint patch_bits(int s, int row) { return s_squares[s][row] | s_fans[s][row]; }

void count_patches(int tile, int s) {
    uint patches = 0u;
    for (int r = 0; r < TILE; r++) patches += uint(bitCount(patch_bits(s, r)));
    s_offset[offset_index(s, tile)] = patches;
    atomicAdd(s_count[s], patches);
}

void write_row(int tile, int s) {
    if (patch_bits(s, row) == 0u) return;
    uint place = s_offset[offset_index(s, tile)];
    for (int r = 0; r < row; r++) place += uint(bitCount(patch_bits(s, r)));
    uvec4 finer = finer_neighbours(level, first.x / TILE, first.y + row);
    for (uint left = patch_bits(s, row); left != 0u; left &= left - 1u) {
        int column = findLSB(left);
        ivec2 at = first + ivec2(column, row), corner = at << level;
        bool fan = (s_fans[s][row] >> column & 1u) != 0u;
        int side_log2 = fan ? level : level + s;
        uint split_ = level > 0 ? split_edges(finer, level, at) : 0u;  // edges of a cell that is cut are whole
        ivec4 edges_log2 = fan ? ivec4(uvec4(split_) >> uvec4(0, 1, 2, 3) & 1u) : ivec4(s);
        uint word = shape_word(side_log2, side_log2 - s, edges_log2) | (fan ? IS_FAN : 0u);
        patches[place++] = ivec4(corner, word, floatBitsToInt(-1.0));
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

    for (int s = 0; s < SIZES; s++) s_squares[s][row] = s_fans[s][row] = 0u;
    if (row == 0) s_tile_triangles = s_tile_splits = s_tile_worst = 0u;
    barrier();
    classify_row();
    barrier();
    if (row == 0 && !u_emits) {
        atomicAdd(s_triangles, s_tile_triangles);
        atomicAdd(s_splits, s_tile_splits);
        atomicMax(s_worst_px, s_tile_worst);
    }
    form_squares(level, first, row);
    if (!u_emits && row < SIZES) count_patches(tile, row);
    if (u_emits) for (int s = 0; s < SIZES; s++) write_row(tile, s);
}
