// horizon/sunlit.comp — the sunlight on the ground, as values to be summed: means over blocks of 2 × 2 cells.
//   The values, signed, in words that wrap:
//     0     E = V ⟨n, sun⟩        visible share of the disc × cosine
//     1, 2  E s                   E × the slope s, east and north
//     3, 4  s
//   Products are stored because the mean of a product is not the product of the means:
//   slopes that turn away from the sun are often in shadow, and an eye sees more of the slopes that face it.
//   For comparison only, PRINTED 1 leaves out the cosine, as equation A.5 does: E = V.
// Python twins: reference.sunlit, reference.visible_shares

#include "horizon/lines.glsl"
#include "horizon/cell.glsl"
#include "horizon/disc.glsl"

layout(local_size_x = 64) in;
layout(r16, binding = 3) readonly uniform image2DArray u_horizons;
RECORDS_IN(u_horizons)
layout(std430, binding = 0) writeonly buffer Sunlit { int sunlit[]; };

uniform vec2 u_towards;
uniform vec3 u_sun;
uniform int u_first_row;  // first row of blocks of this run

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, u_first_row), blocks = cell_blocks();
    if (at.x >= blocks.x) return;
    float sum[SUN_LAYERS] = float[SUN_LAYERS](0.0, 0.0, 0.0, 0.0, 0.0), cells = 0.0;
    for (int k = 0; k < 4; k++) {
        ivec2 cell = 2 * at + ivec2(k & 1, k >> 1);
        if (any(greaterThanEqual(cell, u_last_post))) continue;
        vec3 n = normal_of_cell(cell);
        vec2 slope = clamp(-n.xy / n.z / STEEPEST, -1.0, 1.0);
        float share = disc_share(sine_of(record_near(0, u_towards, vec2(cell) + 0.5)));
        float light = PRINTED >= 1 ? share : share * max(dot(n, u_sun), 0.0);
        float values[SUN_LAYERS] = float[SUN_LAYERS](light, light * slope.x, light * slope.y, slope.x, slope.y);
        for (int i = 0; i < SUN_LAYERS; i++) sum[i] += values[i];
        cells += 1.0;
    }
    for (int i = 0; i < SUN_LAYERS; i++)
        sunlit[(i * blocks.y + at.y) * blocks.x + at.x] = int(round(sum[i] / cells * SUN_STEPS));
}
