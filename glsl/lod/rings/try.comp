// lod/rings/try.comp — counts a block's triangles at each of PRICES prices. Squares are joined from the units up, as in
// lod/rings/decide.comp. One work group handles one block, one thread handles one price.

#include "lod/rings/squares.glsl"
#include "lod/rings/prices.glsl"

layout(local_size_x = PRICES) in;

uniform int u_pass;

// Cost and triangles of a square: as one leaf, or as its parts.
vec2 cheaper(vec2 whole, vec2 parts) { return whole.x <= parts.x ? whole : parts; }

vec2 whole_at(int depth, ivec2 at, float price_) {
    int segments_log2;
    return cheapest(u_first + square_index(depth, at), side_log2_at(depth), price_, segments_log2);
}

vec2 quarter(ivec2 at, float price_) {
    vec2 parts = vec2(0.0);
    for (int i = 0; i < 4; i++) {
        ivec2 part = 2 * at + ivec2(i & 1, i >> 1);
        vec2 units = vec2(0.0);
        for (int k = 0; k < 4; k++) units += whole_at(3, 2 * part + ivec2(k & 1, k >> 1), price_);
        parts += cheaper(whole_at(2, part, price_), units);
    }
    return cheaper(whole_at(1, at, price_), parts);
}

void main() {
    int k = int(gl_LocalInvocationIndex), b = seen_block(gl_WorkGroupID.x);
    take_block(b_block[b]);
    u_first = SQUARES * b;
    float price_ = price_at(u_pass, k);
    vec2 parts = vec2(0.0);
    for (int i = 0; i < 4; i++) parts += quarter(ivec2(i & 1, i >> 1), price_);
    uint triangles = uint(cheaper(whole_at(0, ivec2(0), price_), parts).y);
    atomicAdd(tried[PRICES * u_pass + k], min(triangles, 0xffffffffu / b_seen.groups));  // so the sum stays below 2^32
}
