// horizon/cell.glsl — the ground's normal in the centre of a cell, from its four posts.
// Tables have a texel for each block of 2 × 2 cells.
// Provides normal_of_cell(), cell_blocks().   Python twin: reference.normals_of

#include "blocks/terrain.glsl"

#ifndef PRINTED
#define PRINTED 0  // 1, 2: as the supplement prints light (benchmarks/glsl)
#endif

vec3 normal_of_cell(ivec2 cell) {
    float nw = height_m(cell);
    float ne = height_m(cell + ivec2(1, 0));
    float sw = height_m(cell + ivec2(0, 1));
    float se = height_m(cell + 1);
    vec2 slope = 0.5 * vec2(ne - nw + se - sw, nw - sw + ne - se) / u_spacing_m;
    return normalize(vec3(-slope, 1.0));
}

ivec2 cell_blocks() { return (u_last_post + 1) / 2; }
