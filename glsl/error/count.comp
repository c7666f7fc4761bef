// error/count.comp — the values that a level's summed-area tables sum: for each tile and class, 1 if the tile's error
//   is above the class's limit; and the squared error of each tile. One thread computes one tile.
// Python twins: reference.class_tables, reference.square_table

#include "error/nodes.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 0) readonly buffer Nodes { uint node[]; };
layout(std430, binding = 1) writeonly buffer Counters { uint counter[]; };
layout(std430, binding = 2) writeonly buffer Squares { uvec2 square[]; };

uniform int u_which_level;
uniform int u_first_counter;  // where the tables of counters and squares begin in their buffers
uniform int u_first_square;
uniform ivec2 u_first;  // first tile
uniform ivec2 u_count;  // columns and rows of tiles

// Largest error of a node as a cell of a patch, whatever edges of it are cut, and the sum of its squared errors in
// units of span². A cell of the map, level 0, has errors only between its posts: at most |t|/4, and |t|/8 in the root
// mean square (t is its twist).
float node_max_m(ivec2 at) {
    if (u_which_level == 0) return is_hole(at) ? 0.0 : 0.25 * abs(twist_m(at)) * (1.0 + exp2(-20.0));
    return unpack_errors(node[node_index(u_which_level, at)]).x;
}

float node_squares(ivec2 at) {
    if (u_which_level == 0) {
        float t = is_hole(at) ? 0.0 : twist_m(at) / u_span_m;
        return t * t / 64.0;
    }
    float rms_m = unpack_errors(node[node_index(u_which_level, at)]).y;
    return rms_m / u_span_m * (rms_m / u_span_m) * own_posts(u_which_level, at);
}

void main() {
    ivec2 tile = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(tile, u_count))) return;
    int i = tile.y * u_count.x + tile.x;
    int side = 1 << tile_log2(u_which_level);
    ivec2 low = (u_first + tile) * side, high = min(low + side, u_level[u_which_level].size);
    float worst_m = 0.0;
    uvec2 squares = uvec2(0u);
    for (int y = low.y; y < high.y; y++)
        for (int x = low.x; x < high.x; x++) {
            worst_m = max(worst_m, node_max_m(ivec2(x, y)));
            squares = add64(squares, square_up(node_squares(ivec2(x, y))));
        }
    for (int word = 0; word < CLASSES / 4; word++) {
        uint four = 0u;
        for (int k = 0; k < 4; k++) four |= uint(worst_m > class_limit_m(4 * word + k)) << 8 * k;
        counter[u_first_counter + word * u_count.x * u_count.y + i] = four;
    }
    square[u_first_square + i] = squares;
}
