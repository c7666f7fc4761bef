// error/small.comp — nodes of 2 × 2 cells, level 1, that the map's rim does not cut off. Loops have constant bounds, so
//   compilers unroll them, compute weights, and read each height once. Mesa unrolls a long loop only if the loop
//   variable is the index into an array with as many elements as the loop has steps. So the last two loops begin at 0.
// Python twin: reference.cut_errors

#define LEVEL 1
#define WHOLE_NODES true
#include "error/record.glsl"

#define SIDE 2

layout(local_size_x = 8, local_size_y = 8) in;

void main() {
    if (any(greaterThanEqual(ivec2(gl_GlobalInvocationID.xy), u_count))) return;
    ivec2 at = u_first + ivec2(gl_GlobalInvocationID.xy);
    Node n = node_at(LEVEL, at);
    CutEdges cuts = cut_edges_m(n);
    CellErrors errors = no_errors();
    PostErrors e[SIDE + 1][SIDE + 1];
    for (int y = 0; y <= SIDE; y++)
        for (int x = 0; x <= SIDE; x++) {
            e[y][x] = errors_at(n, cuts, ivec2(x, y));
            gather_post(errors, n, e[y][x], ivec2(x, y));
        }
    for (int x = 0; x <= SIDE; x++)  // cells on the falling diagonal, north-west of posts
        if (x > 0 && !is_hole(n.low + x - 1))
            gather_cell(errors, n, e[x - 1][x - 1], e[x][x], e[x - 1][x], e[x][x - 1], 0.0);
    for (int x = 0, y = SIDE; x <= SIDE; x++, y--)  // cells on the rising diagonal, south-west of posts
        if (x > 0 && !is_hole(n.low + ivec2(x - 1, y)))
            gather_cell(errors, n, e[y + 1][x - 1], e[y][x], e[y + 1][x], e[y][x - 1], 0.0);
    write_record(at, n, errors);
}
