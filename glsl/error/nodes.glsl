// error/nodes.glsl — records of the error table: for each node the largest error and the root mean square, as quad and
//   as fan.
//   max_m: the largest error inside the node, edges included.   rms_m: the root mean square over the node's own posts.
//   Posts of the north and west edges are its own; those of the south and east edges belong to the neighbours. So any
//   set of nodes that covers the map counts every post once.
//   Voids have no error. If a node has voids, the mean over its remaining posts is larger than rms_m; the sign of rms_m
//   marks such nodes. The stored error of a fan is never below the errors of the node's children. So if a node within
//   the tolerance must be split because of a neighbour, its children are within the tolerance, too.
// Errors are half floats in units of span · 2^-14, rounded up: all values of (0, span] are normal numbers.
// Squared errors are 64-bit fixed point, rounded up: span² is 2^35, so 2^28 posts of the largest error do not overflow.
// Provides PackedNode, pack_pair(), unpack_pair(), pack_shares(), unpack_shares(), pack_range(), square_up(),
// texels_rms_m(), posts_rms_m(), mean_is_known(), own_posts(), squares_m2().
// Python twin: gpu.layout.NODE

#include "blocks/terrain.glsl"
#include "sat/bits.glsl"

#define HAS_VOIDS 0x8000u

struct PackedNode {
    uint cut_m;         // half floats, as a cell of a patch, whatever edges are cut: largest error low, RMS high
    uint rms_m, max_m;  // half floats: quad low, fan high; rms_m may have HAS_VOIDS
    // errors of the fan's wedges W, N, E, S, edge whole or split: one byte each, relative to the fan's max_m
    uint whole, split;
};

float error_unit_m() { return u_span_m * exp2(-14.0); }

uint half_up(float x) {
    if (x <= 0.0) return 0u;
    uint h = packHalf2x16(vec2(max(x, exp2(-14.0)), 0.0)) & 0xffffu;
    return unpackHalf2x16(h).x < x ? h + 1u : h;
}

uint pack_pair(vec2 e_m) {
    vec2 e = e_m / error_unit_m() * (1.0 + exp2(-20.0));
    return half_up(e.x) | half_up(e.y) << 16;
}

// Four errors as bytes: sixteenths of an octave below the largest error, rounded so that no error becomes smaller.
uint pack_shares(vec4 e_m, float most_m) {
    if (most_m == 0.0) return 0u;
    uvec4 below = uvec4(clamp(floor(16.0 * log2(most_m / max(e_m, 1e-6 * most_m)) - 0.01), 0.0, 255.0));
    return below.x | below.y << 8 | below.z << 16 | below.w << 24;
}

vec4 unpack_shares(uint shares, float most_m) {
    return most_m * exp2(vec4(uvec4(shares, shares >> 8, shares >> 16, shares >> 24) & 255u) / -16.0);
}

vec2 unpack_pair(uint pair) { return unpackHalf2x16(pair) * error_unit_m(); }

// Lowest and highest height of a node: 16-bit steps of the span above its low end, lowest in the low half.
uint pack_range(vec2 low_high_m) {
    vec2 steps = (low_high_m - u_low_m) / u_span_m * 65535.0;
    uvec2 outward = uvec2(clamp(vec2(floor(steps.x - 0.1), ceil(steps.y + 0.1)), 0.0, 65535.0));
    return outward.x | outward.y << 16;
}

// `share` is a squared error, or a sum of squared errors, in units of span².
uvec2 square_up(float share) {
    float s = share * 8.0 * (1.0 + exp2(-18.0)), high = floor(s);
    return share == 0.0 ? uvec2(0u) : add64(uvec2(uint((s - high) * 4294967296.0), uint(high)), uvec2(1u, 0u));
}

bool mean_is_known(PackedNode n) { return (n.rms_m & HAS_VOIDS) == 0u; }

// Root mean squares of quad and fan. Voids count as posts without error.
vec2 texels_rms_m(PackedNode n) { return unpack_pair(n.rms_m & ~HAS_VOIDS); }

vec2 posts_rms_m(PackedNode n) { return mean_is_known(n) ? texels_rms_m(n) : unpack_pair(n.max_m); }

float own_posts(int level, ivec2 at) {
    ivec2 low = at << level, high = min(low + (1 << level), u_last_post);
    ivec2 posts = high - low + ivec2(equal(high, u_last_post));
    return float(posts.x) * float(posts.y);
}

// Sums of squared errors over the node's own posts: quad, fan.
vec2 squares_m2(PackedNode n, int level, ivec2 at) {
    vec2 rms_m = texels_rms_m(n);
    return rms_m * rms_m * own_posts(level, at);
}
