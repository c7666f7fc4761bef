// light/merged.glsl — means of the ground's lobes over any footprint (C.3), from summed-area tables:
//   see light/lobes.glsl.
//   Sums are bilinear between texels, so means are continuous in the footprint.
//   A diagonal footprint is cut along its length into n boxes; its mean is the average of the boxes' means:
//
//            ┌──┐            u, v: the sides of the pixel on the map. e is the longer half axis of the ellipse with
//         ┌──┼──┘            covariance u uᵀ + v vᵀ. Each of the n pieces has the covariance
//      ┌──┼──┘               u uᵀ + v vᵀ − (1 − 1/n²) e eᵀ.
//      └──┘
//   So light and albedo of a footprint are means over the map itself, and do not depend on the mesh.
// Provides merged_over().   Python twin: reference.box_mean

#include "light/lobes.glsl"

#ifdef PAGED
// Never called: a program for pages has no sums.
Merged merged_over(vec2 post, vec2 extent, vec2 along, int pieces) { return Merged(vec3(0.0), vec3(0.0), vec3(0.0)); }
#else
#define LARGEST_BLOCKS 255.0  // a side of a box: 65,536 blocks of 16 bits are exact

#ifdef WORDS_IN_TEXTURES
layout(binding = 13) uniform usamplerBuffer u_lobe_sums;
#define LOBE_SUM(i) texelFetch(u_lobe_sums, i).x
#else
layout(std430, binding = 3) readonly buffer Lobes { uint lobe_sum[]; };  // signed
#define LOBE_SUM(i) lobe_sum[i]
#endif

struct LobeBox {
    ivec4 x, row;  // columns before the sides; rows before the sides, times the table's width; negative before the rim
    vec4 part;     // fraction of a texel that a side is beyond its first word: west, north, east, south
    float area;
};

LobeBox lobe_box(vec2 middle, vec2 extent) {
    ivec2 size = lobe_blocks();
    vec2 half_extent = 0.5 * clamp(extent, vec2(1.0), vec2(LARGEST_BLOCKS));
    vec2 a = clamp(middle - half_extent, vec2(0.0), vec2(size) - 0.5);
    vec2 c = clamp(middle + half_extent, vec2(0.5), vec2(size));
    ivec4 next = ivec4(0, 1, 0, 1);  // added to whole numbers: a + 1.0 may round up to one more
    ivec4 x = min(ivec4(a.xx, c.xx) + next, size.x) - 1, y = min(ivec4(a.yy, c.yy) + next, size.y) - 1;
    return LobeBox(x, y * size.x, fract(vec4(a, c)), (c.x - a.x) * (c.y - a.y));
}

// The sum up to a word; 0 beyond the rim. A mask is faster than a branch.
int lobe_word(int layer_start, int x, int row) {
    return int(LOBE_SUM(layer_start + max(row, 0) + max(x, 0))) & ~((x | row) >> 31);
}

// Differences of wrapped sums are exact as integers; convert them to float afterwards.
float lobe_mean(int layer, LobeBox b) {
    int start = layer * lobe_blocks().x * lobe_blocks().y;
    ivec3 first;
    vec4 rows;
    for (int j = 0; j < 4; j++) {
        int west = lobe_word(start, b.x[0], b.row[j]);
        ivec3 sums = ivec3(lobe_word(start, b.x[1], b.row[j]), lobe_word(start, b.x[2], b.row[j]),
            lobe_word(start, b.x[3], b.row[j])) - west;
        if (j == 0) first = sums;
        vec3 s = vec3(sums - first);
        rows[j] = mix(s.y, s.z, b.part.z) - s.x * b.part.x;
    }
    return (mix(rows.z, rows.w, b.part.w) - rows.y * b.part.y) / (b.area * LOBE_STEPS);
}

Merged merged_over(vec2 post, vec2 extent, vec2 along, int pieces) {
    float sum[LOBE_LAYERS];
    for (int k = 0; k < LOBE_LAYERS; k++) sum[k] = 0.0;
    for (int i = 0; i < pieces; i++) {
        vec2 middle = post + along * ((float(i) + 0.5) / float(pieces) - 0.5);
        LobeBox box = lobe_box(0.5 * middle, 0.5 * extent);
        for (int k = 0; k < LOBE_LAYERS; k++) sum[k] += lobe_mean(k, box) / float(pieces);
    }
    vec3 albedo = max(vec3(sum[6], sum[7], sum[8]), 0.0);
    return Merged(vec3(sum[0], sum[1], sum[2]) / max(dot(albedo, LUMINANCE), 1e-4), vec3(sum[3], sum[4], sum[5]),
        albedo);
}
#endif
