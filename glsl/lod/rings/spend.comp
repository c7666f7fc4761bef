// lod/rings/spend.comp — like lod/rings/decide.comp, but the price λ of a triangle decides.
//       cost(square) = min( min over T of ( squared error + λ (2 T² + PATCH_COST) ),  sum of its parts' costs )
//   One work group handles one block, one thread handles one unit.
// Python twins: reference.rings.cheapest, reference.rings.cut_block

#include "lod/rings/squares.glsl"
#include "lod/rings/prices.glsl"

layout(local_size_x = UNITS) in;

uniform float u_price;

void price_square(int depth, ivec2 at) {
    int i = square_index(depth, at), segments_log2;
    vec2 best = cheapest(first_square + i, side_log2_at(depth), u_price, segments_log2);
    s_cost[i] = best.x;
    uint state = best == vec2(0.0) ? EMPTY : depth == 3 ? WHOLE : OPEN;
    s_square[i] = uint(side_log2_at(depth) - segments_log2 + 16) | state;
}

void main() {
    int unit = int(gl_LocalInvocationIndex), b = int(listed[gl_WorkGroupID.x].seen_block);
    take_block(b_block[b]);
    first_square = SQUARES * b;
    for (int depth = 3; depth >= 0; depth--)
        if (unit < 1 << 2 * depth) price_square(depth, square_at(depth, unit));
    join_all(2, unit, UNITS);
    write_units(b, unit, UNITS);
}
