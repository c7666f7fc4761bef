// lod/rings/horizon.comp — the horizon around the eye. One thread handles one sector, and goes outward.
//   A chord crosses the sector at each shell. All sight lines of the sector cross this chord. So the lowest height
//   around the chord is a horizon for all of them. It is read from nodes that are about as large as the chord is long.
//   Voids hide nothing: they are drawn at any height between their corners.
// Python twin: reference.horizon_around

#include "lod/rings/hidden.glsl"

layout(local_size_x = THREADS) in;
layout(r32f, binding = 0) uniform writeonly image2D u_out;

// Lowest height of a box of posts. The nodes are as large as the box, so it meets at most two nodes a side: those at
// its corners. We look at all four corners: a loop from `first` to `end` crashes zink 22.3 on a CPU.
float lowest_of_box_m(vec2 low, vec2 high) {
    vec2 size = high - low;
    int level = clamp(int(ceil(log2(max(max(size.x, size.y), 2.0)))), 1, u_top_level);
    ivec2 last = u_level[level].size - 1, first = min(ivec2(low) >> level, last), end = min(ivec2(high) >> level, last);
    float lowest_m = HUGE;
    for (int i = 0; i < 4; i++) {
        ivec2 at = ivec2((i & 1) == 0 ? first.x : end.x, (i & 2) == 0 ? first.y : end.y);
        uint word = range[range_index(level, at)];
        bool has_voids = (word & 0xffffu) > word >> 16;
        lowest_m = min(lowest_m, has_voids ? -HUGE : unpack_range(word).x);
    }
    return lowest_m;
}

vec2 post_under(vec2 from_eye_m) {
    return vec2(u_eye_post) + vec2(1.0, -1.0) * (from_eye_m + u_eye_offset_m) / u_spacing_m;
}

void main() {
    int sector = u_sectors.x + int(gl_GlobalInvocationID.x);
    if (sector >= u_sectors.y) return;
    vec2 a = sector_direction(sector), b = sector_direction(sector + 1);
    float middle = 0.5 * length(a + b) * (1.0 - 1e-6);  // the chord's smallest distance divided by its largest
    float slope = -HUGE;
    vec2 most = vec2(u_last_post);
    for (int k = 0; k < u_shells; k++) {
        float r_m = shell_radius_m(k);
        vec2 p = post_under(r_m * a), q = post_under(r_m * b), margin = 0.01 + 1e-6 * (abs(p) + abs(q));
        vec2 low = min(p, q) - margin, high = max(p, q) + margin;
        bool is_on_map = k > 0 && all(greaterThanEqual(low, vec2(0.0))) && all(lessThanEqual(high, most));
        float lowest_m = is_on_map ? lowest_of_box_m(low, high) : -HUGE;
        float up_m = up_from_eye_m(lowest_m) - u_bend_per_m * r_m * r_m - 0.25 * (u_bulge_m.x + u_bulge_m.y);
        if (is_on_map) slope = max(slope, up_m / (up_m > 0.0 ? r_m : r_m * middle));
        imageStore(u_out, ivec2(sector, k), vec4(slope));
    }
}
