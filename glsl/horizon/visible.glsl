// horizon/visible.glsl — the visible share of each light for a footprint: lookups in the tables of light/horizon.py.
//   sky_visible     mean of V_l over the footprint, weighted by the cosine    (A.5, with horizon/fold.comp)
//   sky_visible_near  the same without sums, for footprints smaller than the smallest box: all lobes, three a column
//   sun_over        mean of V · ⟨n, sun⟩ over the visible facets: 1 for ground that faces the sun
//   sun_share       share of the sun's disc that one place sees
// Footprints are boxes in posts. Sums are bilinear between texels (shade/relief.glsl), so means are continuous. For
// footprints of less than a few posts, the sun's horizon itself is read, and its angle is interpolated bilinearly.
// So the edge of a shadow is as sharp as the sun allows.
// Python twins: reference.sunlit, reference.skylit, reference.box_mean

#include "horizon/lines.glsl"
#include "horizon/disc.glsl"
#include "horizon/cell.glsl"

#ifndef LOBES
#define LOBES 4
#define TEXEL 2  // posts across a texel of the sky
#define FULL 4095.0
#endif
#define LARGEST_SUM_POSTS 1000.0  // 2^20 texels of 12 bits are exact

vec3 unpacked(uint word) { return vec3(word & 1023u, word >> 10 & 1023u, word >> 20 & 1023u) / 1023.0; }

#ifndef PAGED
#include "light/tables.glsl"

const bool HAS_SUMS = true;

layout(r16, binding = 0) readonly uniform image2DArray u_sun_horizon;
RECORDS_IN(u_sun_horizon)

layout(rgba32ui, binding = 1) readonly uniform uimage2D u_packed;  // shares that are not summed: fold.comp

uniform vec2 u_sun_towards;

ivec2 share_texels() { return (u_last_post - 1) / TEXEL + 1; }

// A footprint's box, inside the map and not smaller than `least`;
// cell (i, j) is between posts (i, j) and (i + 1, j + 1).
vec4 box_of(vec2 post, vec2 extent, float least) {
    vec2 half_extent = 0.5 * clamp(extent, least, LARGEST_SUM_POSTS), end = vec2(u_last_post);
    return vec4(clamp(post - half_extent, vec2(0.0), end - 1.0), clamp(post + half_extent, vec2(1.0), end));
}

#define LEAST_SKY_POSTS (1.5 * float(TEXEL))

float sky_visible(int lobe, vec2 post, vec2 extent) {
    vec4 box = box_of(post, extent, LEAST_SKY_POSTS) / float(TEXEL);
    TexelBox texels = box_between(box.xy, min(box.zw, vec2(share_texels())), share_texels());
    return table_mean(SKY_SHARES, lobe, texels) / FULL;
}

// Along one axis, a box reaches from a to c: the share that it covers of each of three neighbouring texels.
vec3 covered(float a, float c, float first) {
    vec3 low = first + vec3(0.0, 1.0, 2.0);
    return max(min(vec3(c), low + 1.0) - max(vec3(a), low), 0.0);
}

mat4x3 sky_visible_near(vec2 post, vec2 extent) {
    vec4 box = box_of(post, vec2(0.0), LEAST_SKY_POSTS) / float(TEXEL);
    vec2 a = box.xy, c = min(box.zw, vec2(share_texels())), first = floor(a);
    vec3 x = covered(a.x, c.x, first.x) / (c.x - a.x), y = covered(a.y, c.y, first.y) / (c.y - a.y);
    mat4x3 visible = mat4x3(0.0);
    for (int k = 0; k < 9; k++) {
        uvec4 words = imageLoad(u_packed, min(ivec2(first) + ivec2(k % 3, k / 3), share_texels() - 1));
        float weight = x[k % 3] * y[k / 3];
        for (int i = 0; i < (LOBES + 2) / 3; i++) visible[i] += weight * unpacked(words[i]);
    }
    return visible;
}

float sun_share(vec2 post, vec2 extent) { return disc_share(sine_of(record_near(0, u_sun_towards, post))); }

// E is the sunlight of a facet (horizon/sunlit.comp), s its slope; Ē and s̄ are their means over the ground.
// In the picture, a facet has the weight 1 − lean · (s − s̄): see lean_of().
// So the mean of E over the picture is Ē − lean · (mean of E s − Ē s̄).
float sun_over(vec2 post, vec2 extent, vec2 lean) {
    vec4 box = 0.5 * box_of(post, extent, 2.0);
    TexelBox blocks = box_between(box.xy, box.zw, cell_blocks());
    float mean[SUN_LAYERS];
    for (int k = 0; k < SUN_LAYERS; k++) mean[k] = table_mean(SUNLIT, k, blocks) / SUN_STEPS;
    vec2 together = vec2(mean[1], mean[2]) - mean[0] * vec2(mean[3], mean[4]);
    return clamp(mean[0] - STEEPEST * dot(lean, together), 0.0, 1.0);
}
#else
#include "pages/visible.glsl"
#endif
