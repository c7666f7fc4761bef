// horizon/fold.comp — from horizons to visible shares of the sky's lobes. One thread computes one texel.
//   A cell with normal n gets the light n · M(a, s, l) of lobe l from the sector around azimuth a,
//   over a horizon of sine s:
//     M = ∫ SG_l(ω) ω dω / ∫ SG_l dω    the upper integral over the sector's directions above the horizon.
//   The sum over a is all light of the lobe that the cell gets.
//   If only the ground's own plane hid the sky, the cell would get C_l(n). So
//     V_l(texel) = Σ over cells Σ over a n · M / Σ over cells C_l(n)
//   is the mean visibility, weighted by the light that each cell would get without a horizon.
// The shares of all lobes are also packed into one texel, before they are summed: one fetch reads them all.
// Word i of a texel holds lobes 3i, 3i + 1 and 3i + 2, ten bits each.
// For comparison only, PRINTED 1 is equation A.5 as printed, without a cosine:
// V_l = ∫ SG_l V dω / ∫ SG_l dω, both above the horizontal.
// Python twins: reference.skylit, reference.visible_shares, reference.pack_shares

#include "horizon/lines.glsl"
#include "horizon/cell.glsl"

#ifndef LOBES
#define LOBES 4
#define SINES 256    // steps of the sine from −1 to 1
#define COSINES 64   // steps of n · axis from −1 to 1
#define AZIMUTHS 16
#define TEXEL 3      // cells a side
#define FULL 4095.0  // share of 1
#endif

layout(local_size_x = 64) in;
layout(r16, binding = 3) readonly uniform image2DArray u_horizons;
RECORDS_IN(u_horizons)
layout(std430, binding = 0) writeonly buffer Shares { uint share[]; };
layout(rgba32ui, binding = 0) uniform writeonly uimage2D u_packed;
// A row for each azimuth and sine, a column for each lobe: M, and ∫ SG dω / ∫ SG dω over the same directions.
layout(binding = 2) uniform sampler2D u_moments;
layout(std430, binding = 2) readonly buffer Open { float open_share[]; };  // lobe, cosine

uniform vec2 u_directions[AZIMUTHS];
uniform vec3 u_axes[LOBES];
uniform ivec2 u_texels;
uniform int u_first_row;
uniform ivec2 u_corner;      // of the texels in u_packed, which has those of all pages
uniform ivec2 u_first_cell;  // first cell of the first texel of a page; 0 for a map

float open_to(int lobe, vec3 normal) {
    float at = clamp(0.5 + 0.5 * dot(normal, u_axes[lobe]), 0.0, 1.0) * float(COSINES);
    int i = lobe * (COSINES + 1) + min(int(at), COSINES - 1);
    return mix(open_share[i], open_share[i + 1], at - floor(min(at, float(COSINES - 1))));
}

// Where the ground's own plane meets the sky: n · ω = 0. Below it the cosine counts as zero.
float own_horizon(vec3 n, vec2 towards) {
    vec2 flat_ = normalize(vec2(towards.x, -towards.y) * u_spacing_m);
    float slope = -dot(n.xy, flat_) / n.z;
    return 0.5 + 0.5 * slope * inversesqrt(1.0 + slope * slope);
}

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, u_first_row);
    if (texel.x >= u_texels.x) return;

    float unshadowed[LOBES], sum[LOBES];
    for (int l = 0; l < LOBES; l++) unshadowed[l] = sum[l] = 0.0;
    for (int k = 0; k < TEXEL * TEXEL; k++) {
        ivec2 cell = u_first_cell + texel * TEXEL + ivec2(k % TEXEL, k / TEXEL);
        cell = clamp(cell, first_inside(), last_inside() - 1);  // the nearest one on the map
        vec3 normal = normal_of_cell(cell);
        for (int l = 0; l < LOBES; l++) unshadowed[l] += open_to(l, normal);
        for (int a = 0; a < AZIMUTHS; a++) {
            float record = record_near(a, u_directions[a], vec2(cell) + 0.5);
            float at = max(record, PRINTED >= 1 ? 0.5 : own_horizon(normal, u_directions[a])) * float(SINES);
            int row = a * (SINES + 1) + int(at + 0.5);
            for (int l = 0; l < LOBES; l++) {
                vec4 moment = texelFetch(u_moments, ivec2(l, row), 0);
                sum[l] += PRINTED >= 1 ? moment.w : dot(normal, moment.xyz);
            }
        }
    }
    uvec4 words = uvec4(0u);
    for (int l = 0; l < LOBES; l++) {
        int i = (l * u_texels.y + texel.y) * u_texels.x + texel.x;
        float visible = round(FULL * clamp(sum[l] / max(unshadowed[l], 1e-6), 0.0, 1.0));
        share[i] = uint(visible);
        words[l / 3] |= uint(round(1023.0 * (visible / FULL))) << 10 * (l % 3);
    }
    imageStore(u_packed, u_corner + texel, words);
}
