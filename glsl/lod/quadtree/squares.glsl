// lod/quadtree/squares.glsl — 2 × 2, 4 × 4, ... 32 × 32 quads that fill a square of the map become one patch.
//   Every quad is within the tolerance, so the patch is, too.
//
//     1 1 1 1 │ 1 1         1s: quads                       a square's bits are joined in steps:
//     1 1 1 1 │ 1 .            ┌───────┐                        row & row >> 1     two side by side
//     1 1 1 1 │ . .     →      │ T = 4 │ T=2 ...                & the row below    two on two
//     1 1 1 1 │ 1 1            └───────┘
//
// Provides s_squares[], form_squares().
// Python twin: reference.join

#include "lod/quadtree/tiles.glsl"

shared uint s_squares[SIZES][TILE];  // one bit for the north-west node of each square of quads

bool on_map(int size, int level, ivec2 at) {
    return all(lessThanEqual((at + (1 << size)) << level, u_last_post));
}

// The squares of size s of a row, from those of size s - 1. Only every 2^s-th row and bit can begin one.
uint join_squares(int s, int level, ivec2 first, int row) {
    int half_side = 1 << (s - 1);
    if ((row & (2 * half_side - 1)) != 0 || level + s > u_top_level) return 0u;
    uint north = s_squares[s - 1][row], south = s_squares[s - 1][row + half_side];
    uint joined = 0u;
    for (uint left = north & north >> half_side & south & south >> half_side; left != 0u; left &= left - 1u) {
        int column = findLSB(left);
        if ((column & (2 * half_side - 1)) == 0 && on_map(s, level, first + ivec2(column, row))) joined |= 1u << column;
    }
    return joined;
}

// Called by all threads of a group, each for its own row of the tile with the north-west node `first`.
void form_squares(int level, ivec2 first, int row) {
    for (int s = 1; 1 << s <= TILE; s++) {
        uint joined = join_squares(s, level, first, row);
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
