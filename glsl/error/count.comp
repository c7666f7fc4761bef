// error/count.comp — the values under the summed-area tables of a level: how many tiles are above each class,
// and the squared error of each tile. One thread fills one tile of COUNT_TILE × COUNT_TILE nodes.

#include "error/nodes.glsl"
#include "error/classes.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 0) readonly buffer Nodes { PackedNode node[]; };
layout(std430, binding = 1) writeonly buffer Counters { uint counter[]; };
layout(std430, binding = 2) writeonly buffer Squares { uvec2 square[]; };

uniform int u_which_level;
uniform int u_first_counter;  // where the tables of counters and squares begin in their buffers
uniform int u_first_square;
uniform ivec2 u_first;  // first tile, and how many
uniform ivec2 u_count;

// All of a node's squared errors as a quad, from their mean.
uvec2 node_squares(float rms_m, ivec2 at) {
    return square_up(rms_m / u_span_m * (rms_m / u_span_m) * own_posts(u_which_level, at));
}

void main() {
    ivec2 tile = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(tile, u_count))) return;
    int i = tile.y * u_count.x + tile.x;
    ivec2 low = (u_first + tile) * COUNT_TILE, high = min(low + COUNT_TILE, u_level[u_which_level].size);
    float worst_m = 0.0;
    uvec2 squares = uvec2(0u);
    for (int y = low.y; y < high.y; y++)
        for (int x = low.x; x < high.x; x++) {
            PackedNode n = node[node_index(u_which_level, ivec2(x, y))];
            worst_m = max(worst_m, unpack_pair(n.max_m).x);
            squares = add64(squares, node_squares(texels_rms_m(n).x, ivec2(x, y)));
        }
    for (int word = 0; word < CLASSES / 2; word++) {
        bvec2 above = greaterThan(vec2(worst_m), vec2(class_limit_m(2 * word), class_limit_m(2 * word + 1)));
        counter[u_first_counter + word * u_count.x * u_count.y + i] = uint(above.x) | uint(above.y) << 16;
    }
    square[u_first_square + i] = squares;
}
