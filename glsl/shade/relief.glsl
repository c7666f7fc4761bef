// shade/relief.glsl — mean height and mean slope over a footprint:
//   a box on the map, at any place and of any size, in posts. Boxes larger than a few posts use the summed-area table
//   of heights. The height is taken as constant over each texel, so the sums are bilinear between texels. So the mean
//   is continuous in the box, and nothing flickers when the eye moves.
//
//          a       b       c        mean height   sum(a..c) / area
//       a  ┌───────┬───────┐        slope         (mean of the eastern half − mean of the western) / distance of
//          │  NW   │  NE   │                      their centres: exactly the mean of the slope to the east, weighted
//       b  ├───────┼───────┤                      by a tent in columns and equally in rows
//          │  SW   │  SE   │        Exact for planes, at any place.
//       c  └───────┴───────┘        Each side needs two texels: 6 × 6 words together.
//
//   Smaller boxes use cubic B-splines over the heights, with continuous second derivatives.
//   In between, the two are blended.
//   Functions that end in _on are for the lattice of one level: places, extents and slopes are in its steps.
//   A map in memory has only level 0. In a store, the loaded pages decide which level is used (pages/relief.glsl).
// Provides Relief, relief_of(), rough_relief().   Python twin: reference.relief

#include "shade/posts.glsl"
#include "shade/kind.glsl"

#define FINEST_BOX_POSTS 1.5     // boxes up to this size use the spline alone

// Sums of 65,536 texels are exact; 250 a side leave room for the rims. After edits beyond the quantisation range, sums
// of fewer texels are.
float largest_box_posts() { return 250.0 * sqrt(u_span_m / most_m()); }

// The unit of the summed heights: the map's span has 65,535 steps. The rounding error of a mean over a box is at most
// half a step, and much less if the terrain crosses many steps.
float step_m() { return u_span_m / 65535.0; }

// Edits may go below the quantisation range. Steps are summed from there on, so that no sum is negative.
uint steps_below() { return uint(ceil(u_beyond_m.x / step_m())); }

float m_from_steps(float steps) { return u_low_m + (steps - float(steps_below())) * step_m(); }

struct Relief {
    float height_m;
    vec2 slope;  // metres up per metre east, north
};

// The table's sums at each of six columns and six rows, minus a number that is the same for all.
void sums_on(int level, int x[6], int y[6], out uint sum[36]) {
    for (int k = 0; k < 36; k++) sum[k] = 0u;
    Part part = first_part(level, ivec2(x[0], y[0]), ivec2(x[5], y[5]));
    do {
        for (int j = 0; j < 6; j++)
            for (int i = 0; i < 6; i++) sum[6 * j + i] += sum_in(part, x[i], y[j]);
    } while (next_part(part));
    if (steps_below() == 0u) return;  // the loop takes a fifth of the time of pixels with edges on llvmpipe
    for (int k = 0; k < 36; k++) sum[k] += steps_below() * uint(x[k % 6] * y[k / 6]);
}

// Sums along a row of words, relative to the western side and to row 0, interpolated to the three sides a, b, c.
vec3 sums_of_row(uint sum[36], int row, vec3 part) {
    float sums[6];
    for (int i = 0; i < 6; i++) {
        uint first = sum[i] - sum[0];  // unsigned integers wrap, so differences are exact
        sums[i] = float(sum[6 * row + i] - sum[6 * row] - first);
    }
    return mix(vec3(sums[0], sums[2], sums[4]), vec3(sums[1], sums[3], sums[5]), part);
}

// Texels turn a ramp into a staircase. A box whose sides cut steps of the staircase gives a slope that is a little
// wrong. So the slope is divided by the result of the same box on a ramp of slope 1.
vec3 stairs_until(vec3 x, float origin) {
    vec3 n = floor(x) - origin;
    return 0.5 * n * (n - 1.0) + n * fract(x);
}

float stairs_rise(vec3 x) {
    vec3 sums = stairs_until(x, floor(x.x));
    return 2.0 * (sums.z - 2.0 * sums.y + sums.x) / (x.z - x.x);
}

float stairs_mean(vec3 x) {
    vec3 sums = stairs_until(x, floor(x.x));
    return floor(x.x) + (sums.z - sums.x) / (x.z - x.x);
}

Relief relief_of_sums(int level, vec2 post, vec2 extent) {
    ivec2 end = last_of(level) + 1;
    vec2 half_extent = 0.5 * min(extent, largest_box_posts());
    vec2 a = clamp(post + 0.5 - half_extent, vec2(0.0), vec2(end));
    vec2 c = clamp(post + 0.5 + half_extent, vec2(0.0), vec2(end));
    vec3 xs = vec3(a.x, 0.5 * (a.x + c.x), c.x), ys = vec3(a.y, 0.5 * (a.y + c.y), c.y);
    int x[6], y[6];
    for (int i = 0; i < 6; i++) {
        x[i] = min(int(xs[i / 2]) + i % 2, end.x);
        y[i] = min(int(ys[i / 2]) + i % 2, end.y);
    }
    uint sum[36];
    sums_on(level, x, y, sum);
    vec3 rows[3];
    for (int j = 0; j < 3; j++)
        rows[j] = mix(sums_of_row(sum, 2 * j, fract(xs)), sums_of_row(sum, 2 * j + 1, fract(xs)), fract(ys[j]));
    vec3 all_rows = rows[2] - rows[0], north_rows = rows[1] - rows[0];
    float total = all_rows.z - all_rows.x, west = all_rows.y - all_rows.x, north = north_rows.z - north_rows.x;
    vec2 size = c - a;
    float area = size.x * size.y;
    vec2 rise = vec2(total - 2.0 * west, total - 2.0 * north) / (0.5 * area) / vec2(stairs_rise(xs), stairs_rise(ys));
    vec2 aside = post - vec2(stairs_mean(xs), stairs_mean(ys));
    return Relief(m_from_steps(total / area + dot(rise, aside)), rise * step_m() / vec2(u_spacing_m.x, -u_spacing_m.y));
}

vec4 spline(float t) {  // cubic B-spline
    vec4 w = vec4(1.0 - t, t, 1.0 - t, t);
    return vec4(w.x * w.x * w.x, 4.0 - 3.0 * t * t * (2.0 - t), 4.0 - 3.0 * w.x * w.x * (1.0 + t), t * t * t) / 6.0;
}

vec4 spline_slope(float t) {
    return vec4(-(1.0 - t) * (1.0 - t), t * (3.0 * t - 4.0), 1.0 + t * (2.0 - 3.0 * t), t * t) * 0.5;
}

// A B-spline would blur the coarse lattices of a store. So their heights are interpolated (Catmull, Rom 1974),
// and their slopes are those of single steps, linear between the middles of steps.
vec4 catmull_rom(float t) {
    return 0.5 * vec4(((2.0 - t) * t - 1.0) * t, (3.0 * t - 5.0) * t * t + 2.0, ((4.0 - 3.0 * t) * t + 1.0) * t,
        (t - 1.0) * t * t);
}

vec4 tents(float t) { return max(1.0 - abs(t - vec4(-1.0, 0.0, 1.0, 2.0)), 0.0); }

vec4 weights_on(int level, float t) { return level == 0 ? spline(t) : catmull_rom(t); }

vec4 slope_weights_on(int level, float t) { return level == 0 ? spline_slope(t) : tents(t + 0.5) - tents(t - 0.5); }

Relief relief_of_spline(int level, vec2 post) {
    ivec2 at = ivec2(floor(post));
    vec2 t = post - vec2(at);
    vec4 wx = weights_on(level, t.x);
    vec4 dx = slope_weights_on(level, t.x);
    vec4 wy = weights_on(level, t.y);
    vec4 dy = slope_weights_on(level, t.y);
    mat4 h = heights_from(level, at - 1);
    vec4 rows = wx * h;
    return Relief(dot(rows, wy), vec2(dot(dx * h, wy), -dot(rows, dy)) / u_spacing_m);
}

Relief relief_on(int level, vec2 post, vec2 extent) {
    if (!MAY_BE_FAR) return relief_of_spline(level, post);
    float blend = smoothstep(FINEST_BOX_POSTS, 3.0, max(extent.x, extent.y));
    Relief near = Relief(0.0, vec2(0.0)), far = near;
    if (blend < 1.0) near = relief_of_spline(level, post);
    if (blend > 0.0) far = relief_of_sums(level, post, max(extent, 2.0));
    return Relief(mix(near.height_m, far.height_m, blend), mix(near.slope, far.slope, blend));
}

// The part of a box's sum that lies in a part of the lattice.
uint box_sum_in(Part part, ivec2 a, ivec2 b) {
    return (sum_in(part, b.x, b.y) - sum_in(part, a.x, b.y)) - (sum_in(part, b.x, a.y) - sum_in(part, a.x, a.y));
}

float mean_m(uint sum, ivec2 a, ivec2 b) {
    int posts = (b.x - a.x) * (b.y - a.y);
    return m_from_steps(float(sum + steps_below() * uint(posts)) / float(posts));
}

// The relief over a box of whole posts, where the result need not be smooth.
Relief rough_relief_on(int level, vec2 post, vec2 extent) {
    ivec2 half_extent = ivec2(max(round(0.5 * min(extent, largest_box_posts())), 1.0));
    ivec2 m = ivec2(post + 0.5);
    ivec2 end = last_of(level) + 1;
    ivec2 a = clamp(m - half_extent, ivec2(0), end - 2), c = clamp(m + half_extent, a + 2, end);
    m = clamp(m, a + 1, c - 1);  // each half has posts, also at the map's rim
    uint all_ = 0u;
    uvec4 sum = uvec4(0u);  // the western, northern, eastern and southern half
    Part part = first_part(level, a, c);
    do {
        all_ += box_sum_in(part, a, c);
        sum += uvec4(box_sum_in(part, a, ivec2(m.x, c.y)), box_sum_in(part, a, ivec2(c.x, m.y)),
            box_sum_in(part, ivec2(m.x, a.y), c), box_sum_in(part, ivec2(a.x, m.y), c));
    } while (next_part(part));
    vec2 west_north = vec2(mean_m(sum.x, a, ivec2(m.x, c.y)), mean_m(sum.y, a, ivec2(c.x, m.y)));
    vec2 east_south = vec2(mean_m(sum.z, ivec2(m.x, a.y), c), mean_m(sum.w, ivec2(a.x, m.y), c));
    vec2 slope = (east_south - west_north) * vec2(2.0, -2.0) / (vec2(c - a) * u_spacing_m);
    vec2 aside = post - 0.5 * vec2(a + c - 1);
    return Relief(mean_m(all_, a, c) + dot(slope, vec2(aside.x, -aside.y) * u_spacing_m), slope);
}

#ifndef PAGED
Relief relief_of(vec2 post, vec2 extent) { return relief_on(0, post, extent); }

Relief rough_relief(vec2 post, vec2 extent) { return rough_relief_on(0, post, extent); }
#else
#include "pages/relief.glsl"
#endif
