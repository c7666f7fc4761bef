// error/record.glsl — write the record and the gain of a node from its largest errors and its parts.
// Provides Parts, parts_of_node(), write_record().
// Python twins: reference.node_errors, reference.cut_errors, reference.split_gains

#include "error/worst.glsl"
#include "error/gain.glsl"

layout(std430, binding = 0) buffer Nodes { PackedNode node[]; };
layout(std430, binding = 4) buffer Ranges { uint range[]; };

#ifndef LEVEL
#define LEVEL 2  // 1 or 2; 2 also means all higher levels
#endif

// Values of a node's parts that go into its own record: squared errors, range of heights, errors as fans, gains.
struct Parts { float squares_m2, gain; uint heights, max_m, rms_m; };

// The word without the exchange that marks voids (blocks/terrain.glsl).
uint sorted_range(uint range) { return max(range, range << 16 | range >> 16); }

uint nest_range(uint a, uint b) { return min(a & 0xffffu, b & 0xffffu) | max(a >> 16, b >> 16) << 16; }

// Positive half floats compare like integers. The fan's value is in the high half.
uint nest_fan(uint own, uint parts) { return (own & 0xffffu) | max(own >> 16, parts >> 16) << 16; }

ivec2 last_part(ivec2 at) { return min(2 * at + 1, u_level[u_which_level - 1].size - 1); }

#if LEVEL == 1  // the parts are cells of the map, drawn as two triangles: they have errors only between their posts
Parts parts_of_node(Node n, ivec2 at) {
    vec3 low = min(min(n.h[0], n.h[1]), n.h[2]), high = max(max(n.h[0], n.h[1]), n.h[2]);
    vec2 range_m = vec2(min(min(low.x, low.y), low.z), max(max(high.x, high.y), high.z)) + n.base_m;
    Parts p = Parts(0.0, 0.0, pack_range(range_m), 0u, 0u);
    for (int i = 0; i < 4; i++) {
        ivec2 cell = n.low + ivec2(i & 1, i >> 1);
        if (all(lessThan(cell, n.high)) && !is_hole(cell)) p.squares_m2 += twist_m(cell) * twist_m(cell) / 90.0;
    }
    return p;
}
#else
Parts parts_of_node(Node n, ivec2 at) {
    Parts p = Parts(0.0, 0.0, 0xffffu, 0u, 0u);
    ivec2 last = last_part(at);
    for (int y = 2 * at.y; y <= last.y; y++)
        for (int x = 2 * at.x; x <= last.x; x++) {
            int i = node_index(u_which_level - 1, ivec2(x, y));
            p.max_m = max(p.max_m, node[i].max_m);
            p.rms_m = nest_fan(p.rms_m, node[i].rms_m);
            p.heights = nest_range(p.heights, sorted_range(range[i]));
            p.squares_m2 += squares_m2(node[i], u_which_level - 1, ivec2(x, y)).x;
            p.gain = max(p.gain, gain[i]);
        }
    return p;
}
#endif

void write_record(ivec2 at, Node n, Worst w) {
    Parts parts = parts_of_node(n, at);
    ivec2 own = n.high - n.low + ivec2(equal(n.high, u_last_post));
    ivec2 many = last_part(at) + 1 - 2 * at;
    // a thread adds up to 33 × 33 squares in floats: each addition may lose 2^-24 of the sum
    vec3 rms_m = min(sqrt(w.squares / (float(own.x) * float(own.y))) * (1.0 + exp2(-14.0)), w.max_m);
    PackedNode own_node;
    own_node.cut_m = pack_pair(vec2(w.max_m.z, rms_m.z));
    own_node.rms_m = nest_fan(pack_pair(rms_m.xy) | (w.voids != 0u ? HAS_VOIDS : 0u), parts.rms_m);
    own_node.max_m = nest_fan(pack_pair(w.max_m.xy), parts.max_m);
    own_node.whole = pack_shares(w.whole_m, unpack_pair(own_node.max_m).y);
    own_node.split = pack_shares(w.split_m, unpack_pair(own_node.max_m).y);
    int i = node_index(u_which_level, at);
    node[i] = own_node;
    range[i] = w.voids != 0u ? parts.heights << 16 | parts.heights >> 16 : parts.heights;
    // computed from the rounded record, so that a gain is always the same
    vec2 leaf_m2 = squares_m2(own_node, u_which_level, at);
    float fan_triangles = 4.0 - float(n.mid.x == n.high.x) - float(n.mid.y == n.high.y);
    float triangles = 2.0 * float(many.x * many.y);
    gain[i] = max(parts.gain, split_gain(leaf_m2.x, leaf_m2.y, fan_triangles, parts.squares_m2, triangles));
}
