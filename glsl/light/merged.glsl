// light/merged.glsl — means of the ground's lobes over any footprint (C.3), from summed-area tables:
//   see light/lobes.glsl. Sums are bilinear between texels, so means are continuous in the footprint. So light and
//   albedo of a footprint are means over the map itself, and do not depend on the mesh.
// Provides merged_over().   Python twin: reference.box_mean

#include "light/lobes.glsl"

#ifdef PAGED
// Never called: a program for pages has no sums.
Merged merged_over(vec2 post, vec2 extent) { return Merged(vec3(0.0), vec3(0.0), vec3(0.0)); }
#else
#include "light/tables.glsl"
#include "horizon/cell.glsl"

#define LARGEST_BLOCKS 255.0  // a side of a box: 65,536 blocks of 16 bits are exact

Merged merged_over(vec2 post, vec2 extent) {
    vec2 half_extent = 0.5 * clamp(0.5 * extent, vec2(1.0), vec2(LARGEST_BLOCKS)), size = vec2(cell_blocks());
    vec2 a = clamp(0.5 * post - half_extent, vec2(0.0), size - 0.5);
    vec2 c = clamp(0.5 * post + half_extent, vec2(0.5), size);
    TexelBox box = box_between(a, c, cell_blocks());
    float mean[LOBE_LAYERS];
    for (int k = 0; k < LOBE_LAYERS; k++) mean[k] = table_mean(MERGED, k, box) / LOBE_STEPS;
    vec3 albedo = max(vec3(mean[6], mean[7], mean[8]), 0.0);
    return Merged(vec3(mean[0], mean[1], mean[2]) / max(dot(albedo, LUMINANCE), 1e-4), vec3(mean[3], mean[4], mean[5]),
        albedo);
}
#endif
