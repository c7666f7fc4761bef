// rings/squares.glsl — the squares of a block: which there are, their place and their heights.
//   Depth d has 2^d × 2^d squares of 8 >> d units a side. A group is a block, a thread one of its units.
// Provides block, square_index(), low_of(), gather_ranges(), is_nothing(), meets_finer_ring().
// Python twin: reference.clipmap.cut_block

#include "rings/leaf.glsl"

const int FIRST[4] = int[4](0, 1, 5, 21);  // squares of each depth: 8, 4, 2, 1 units a side

shared vec2 s_range_m[SQUARES];  // lowest and highest; empty where there is nothing to draw

Block block;
int ring;  // that it lies in

int square_index(int depth, ivec2 at) { return FIRST[depth] + (at.y << depth) + at.x; }
int side_log2_at(int depth) { return block.unit_log2 + 3 - depth; }
ivec2 low_of(int depth, ivec2 at) { return block.origin + (at << side_log2_at(depth)); }
ivec2 square_at(int depth, int i) { return ivec2(i & (1 << depth) - 1, i >> depth); }

bool has_finer_ring() { return ring > 0; }
bool is_nothing(int i) { return s_range_m[i].x > s_range_m[i].y; }
void make_nothing(int i) { s_range_m[i] = vec2(NEVER, -NEVER); }

// Whether a square meets the finer ring in its middle, edges counted.
bool meets_finer_ring(ivec2 low, ivec2 end) {
    if (!has_finer_ring()) return false;
    Ring finer = u_ring[ring - 1];
    return all(lessThanEqual(low, ring_end(finer))) && all(greaterThanEqual(end, finer.origin));
}

vec2 range_of_unit(ivec2 at) {
    ivec2 low = low_of(3, at);
    bool on_map = all(greaterThanEqual(low, ivec2(0))) && all(lessThan(low, u_last_post));
    if (!on_map || (has_finer_ring() && is_within(low, u_ring[ring - 1].origin, ring_end(u_ring[ring - 1]))))
        return vec2(NEVER, -NEVER);
    return range_of_unit_m(low, block.unit_log2);
}

void range_of_parts(int depth, ivec2 at) {
    vec2 whole = vec2(NEVER, -NEVER);
    for (int i = 0; i < 4; i++) {
        vec2 part = s_range_m[square_index(depth + 1, 2 * at + ivec2(i & 1, i >> 1))];
        whole = vec2(min(whole.x, part.x), max(whole.y, part.y));
    }
    s_range_m[square_index(depth, at)] = whole;
}

void gather_ranges(int unit) {
    s_range_m[FIRST[3] + unit] = range_of_unit(unit_at(unit));
    for (int depth = 2; depth >= 0; depth--) {
        barrier();
        if (unit < 1 << 2 * depth) range_of_parts(depth, square_at(depth, unit));
    }
    barrier();
}
