// error/nodes.glsl — records of the error table: the errors of a node as a cell of a patch, whatever edges are cut.
//   The low half is the largest error inside the node, edges included. The high half is the root mean square over the
//   node's area. Voids have no error. Posts of the north and west edges are a node's own; those of the south and east
//   edges belong to the neighbours. So any set of nodes that covers the map counts every post once.
// Errors are half floats in units of span · 2^-8, rounded up. Heights may lie in MOST_SPANS spans (terrain.units_hold),
// so no error overflows.
// Squared errors are 64-bit fixed point, rounded up: span² is 2^35, so 2^28 posts with errors of the span do not
// overflow. error/certified.glsl reads no sum that may.
// Provides pack_errors(), unpack_errors(), pack_range(), square_up(), own_posts().   Python twin: gpu.layout.NODE

#include "blocks/terrain.glsl"
#include "sat/bits.glsl"

float error_unit_m() { return u_span_m * exp2(-8.0); }

uint half_up(float x) {
    if (x <= 0.0) return 0u;
    uint h = packHalf2x16(vec2(max(x, exp2(-14.0)), 0.0)) & 0xffffu;
    return unpackHalf2x16(h).x < x ? h + 1u : h;
}

uint pack_errors(vec2 e_m) {
    vec2 e = e_m / error_unit_m() * (1.0 + exp2(-20.0));
    return half_up(e.x) | half_up(e.y) << 16;
}

// Largest error and root mean square.
vec2 unpack_errors(uint record) { return unpackHalf2x16(record) * error_unit_m(); }

// Lowest and highest height of a node: 16-bit steps of the span above its low end, lowest in the low half.
uint pack_range(vec2 low_high_m) {
    vec2 steps = (low_high_m - u_low_m) / u_span_m * 65535.0;
    vec2 outward = vec2(floor(steps.x - 0.1), ceil(steps.y + 0.1));
    uvec2 ends = uvec2(clamp(outward, vec2(0.0, 1.0), vec2(65534.0, 65535.0)));
    return ends.x | ends.y << 16;
}

// `share` is a squared error, or a sum of squared errors, in units of span².
uvec2 square_up(float share) {
    float s = share * 8.0 * (1.0 + exp2(-18.0)), high = min(floor(s), 4294967040.0);
    return share == 0.0 ? uvec2(0u) : add64(uvec2(uint((s - high) * 4294967296.0), uint(high)), uvec2(1u, 0u));
}

float own_posts(int level, ivec2 at) {
    ivec2 low = at << level, high = min(low + (1 << level), u_last_post);
    ivec2 posts = high - low + ivec2(equal(high, u_last_post));
    return float(posts.x) * float(posts.y);
}
