// error/record.glsl — write the record of a node from its errors, and its range of heights from its parts.
// Provides write_record().   Python twin: reference.cut_errors

#include "error/cells.glsl"

layout(std430, binding = 0) writeonly buffer Nodes { uint node[]; };
layout(std430, binding = 4) buffer Ranges { uint range[]; };

#ifndef LEVEL
#define LEVEL 2  // 1 or 2; 2 also means all higher levels
#endif

#if LEVEL == 1  // the parts are cells of the map
uint range_of_parts(Node n, ivec2 at) {
    vec3 low = min(min(n.h[0], n.h[1]), n.h[2]), high = max(max(n.h[0], n.h[1]), n.h[2]);
    return pack_range(vec2(min(min(low.x, low.y), low.z), max(max(high.x, high.y), high.z)) + n.base_m);
}
#else
// The word without the exchange that marks voids (blocks/terrain.glsl).
uint sorted_range(uint range) { return max(range, range << 16 | range >> 16); }

uint nest_range(uint a, uint b) { return min(a & 0xffffu, b & 0xffffu) | max(a >> 16, b >> 16) << 16; }

uint range_of_parts(Node n, ivec2 at) {
    uint heights = 0xffffu;
    ivec2 last = min(2 * at + 1, u_level[u_which_level - 1].size - 1);
    for (int y = 2 * at.y; y <= last.y; y++)
        for (int x = 2 * at.x; x <= last.x; x++)
            heights = nest_range(heights, sorted_range(range[node_index(u_which_level - 1, ivec2(x, y))]));
    return heights;
}
#endif

void write_record(ivec2 at, Node n, CellErrors errors) {
    // a thread adds up to 33 × 33 squares in floats: each addition may lose 2^-24 of the sum
    float rms_m = sqrt(errors.squares_m2 / own_posts(u_which_level, at)) * (1.0 + exp2(-14.0));
    int i = node_index(u_which_level, at);
    node[i] = pack_errors(vec2(errors.max_m, min(rms_m, errors.max_m)));
    uint heights = range_of_parts(n, at);
    range[i] = errors.voids != 0u ? heights << 16 | heights >> 16 : heights;
}
