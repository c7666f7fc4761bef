// light/record.comp — the values that light/lobes.glsl sums: means over blocks of 2 × 2 cells.
// Python twin: reference.lobe_values

#include "light/lobes.glsl"
#include "horizon/cell.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 3) writeonly buffer Values { int value[]; };

uniform ivec2 u_first;  // first block
uniform ivec2 u_count;  // columns and rows of blocks
uniform int u_first_row;  // first of these rows in this run

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, u_first_row);
    if (at.x >= u_count.x) return;
    float sum[LOBE_LAYERS];
    for (int k = 0; k < LOBE_LAYERS; k++) sum[k] = 0.0;
    float cells = 0.0;
    for (int i = 0; i < 4; i++) {
        ivec2 cell = 2 * (u_first + at) + ivec2(i & 1, i >> 1);
        if (any(greaterThanEqual(cell, u_last_post))) continue;
        vec2 middle = vec2(cell) + 0.5;
        Relief relief = relief_of_spline(0, middle);
        vec3 normal = normal_of_cell(cell);
        Merged m = merged_at(normal, material_of(middle, vec2(1.5), relief));
        vec3 weighted = dot(m.albedo, LUMINANCE) * m.normal;
        float values[LOBE_LAYERS] = float[LOBE_LAYERS](weighted.x, weighted.y, weighted.z, m.r.x, m.r.y, m.r.z,
            m.albedo.x, m.albedo.y, m.albedo.z);
        for (int k = 0; k < LOBE_LAYERS; k++) sum[k] += values[k];
        cells += 1.0;
    }
    int layer = u_count.x * u_count.y, index = at.y * u_count.x + at.x;
    for (int k = 0; k < LOBE_LAYERS; k++)
        value[k * layer + index] = int(round(clamp(sum[k] / cells, -1.0, 1.0) * LOBE_STEPS));
}
