// horizon/fold.comp — from horizons to visible shares of the sky's lobes. One thread computes one texel.
//   A cell with normal n gets the light n · M(a, s, l) of lobe l from the sector around azimuth a,
//   over a horizon of sine s:
//     M = ∫ SG_l(ω) ω dω / ∫ SG_l dω    the upper integral over the sector's directions above the horizon.
//   The sum over a is all light of the lobe that the cell gets.
//   If only the ground's own plane hid the sky, the cell would get C_l(n). So
//     V_l(texel) = Σ over cells Σ over a n · M / Σ over cells C_l(n)
//   is the mean visibility, weighted by the light that each cell would get without a horizon.
// The shader runs once for each batch of azimuths.
// Before the last run, the memory of the shares holds sums as floats.
// Sums are rounded after every four azimuths, so that they do not depend on the size of a batch.
// For comparison only, PRINTED 2 is equation A.5 as printed, without a cosine:
// V_l = ∫ SG_l V dω / ∫ SG_l dω, both above the horizontal.
// Python twins: reference.skylit, reference.visible_shares

#include "horizon/lines.glsl"
#include "horizon/cell.glsl"

#ifndef LOBES
#define LOBES 4
#define SINES 256    // steps of the sine from −1 to 1
#define COSINES 64   // steps of n · axis from −1 to 1
#define BATCH 4      // azimuths, a multiple of 4
#define TEXEL 3      // cells a side
#define FULL 4095.0  // share of 1
#endif
#ifndef PRINTED
#define PRINTED 0  // benchmarks/glsl/prefilter/printed.frag
#endif

layout(local_size_x = 64) in;
layout(r16, binding = 3) readonly uniform image2DArray u_horizons;
RECORDS_IN(u_horizons)
layout(std430, binding = 0) buffer Shares { uint share[]; };
// A row for each azimuth and sine: x, y, z of each lobe, four numbers a texel.
layout(binding = 2) uniform sampler2D u_moments;
layout(std430, binding = 2) readonly buffer Open { float open_share[]; };  // lobe, cosine

uniform vec2 u_directions[BATCH];
uniform vec3 u_axes[LOBES];
uniform ivec2 u_texels;
uniform int u_first_row;
uniform int u_batch;
uniform bool u_is_last;
#ifdef WINDOW
uniform ivec2 u_first_cell;  // first cell of the first texel
#endif
uniform float u_above[LOBES];  // share of each lobe above the horizontal

float open_to(int lobe, vec3 normal) {
    float at = clamp(0.5 + 0.5 * dot(normal, u_axes[lobe]), 0.0, 1.0) * float(COSINES);
    int i = lobe * (COSINES + 1) + min(int(at), COSINES - 1);
    return mix(open_share[i], open_share[i + 1], at - floor(min(at, float(COSINES - 1))));
}

#define TEXELS ((3 * LOBES + 3) / 4)

void read_moments(int row, out vec3 moment[LOBES]) {
    float number[4 * TEXELS];
    for (int i = 0; i < TEXELS; i++) {
        vec4 four = texelFetch(u_moments, ivec2(i, row), 0);
        for (int j = 0; j < 4; j++) number[4 * i + j] = four[j];
    }
    for (int l = 0; l < LOBES; l++) moment[l] = vec3(number[3 * l], number[3 * l + 1], number[3 * l + 2]);
}

// Where the ground's own plane meets the sky: n · ω = 0. Below it the cosine counts as zero.
float own_horizon(vec3 n, vec2 towards) {
    vec2 flat_ = normalize(vec2(towards.x, -towards.y) * u_spacing_m);
    float slope = -dot(n.xy, flat_) / n.z;
    return 0.5 + 0.5 * slope * inversesqrt(1.0 + slope * slope);
}

int share_index(ivec2 texel, int lobe) { return (lobe * u_texels.y + texel.y) * u_texels.x + texel.x; }

// Cell k of a texel. The cell may be outside the map; in a window, the nearest cell of the map takes its place.
ivec2 cell_of(ivec2 texel, int k) {
    ivec2 cell = texel * TEXEL + ivec2(k % TEXEL, k / TEXEL);
#ifdef WINDOW
    cell = clamp(cell + u_first_cell, first_inside(), last_inside() - 1);
#endif
    return cell;
}

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, u_first_row);
    if (texel.x >= u_texels.x) return;

    vec3 normal[TEXEL * TEXEL];  // of each cell; (0, 0, 0) outside the map
    float unshadowed[LOBES], total[LOBES];
    for (int l = 0; l < LOBES; l++) {
        unshadowed[l] = 0.0;
        total[l] = u_batch > 0 ? uintBitsToFloat(share[share_index(texel, l)]) : 0.0;
    }
    for (int k = 0; k < TEXEL * TEXEL; k++) {
        ivec2 cell = cell_of(texel, k);
        normal[k] = vec3(0.0);
        if (any(greaterThanEqual(cell, last_inside()))) continue;
        normal[k] = normal_of_cell(cell);
        for (int l = 0; l < LOBES && u_is_last; l++) unshadowed[l] += PRINTED >= 2 ? u_above[l] : open_to(l, normal[k]);
    }
    for (int first = 0; first < BATCH; first += 4) {
        float sum[LOBES];
        for (int l = 0; l < LOBES; l++) sum[l] = 0.0;
        for (int k = 0; k < TEXEL * TEXEL; k++) {
            if (normal[k].z == 0.0) continue;
            for (int a = first; a < first + 4; a++) {
                float record = record_near(a, u_directions[a], vec2(cell_of(texel, k)) + 0.5);
                float at = max(record, PRINTED >= 2 ? 0.5 : own_horizon(normal[k], u_directions[a])) * float(SINES);
                vec3 moment[LOBES];
                read_moments((u_batch * BATCH + a) * (SINES + 1) + int(at + 0.5), moment);
                for (int l = 0; l < LOBES; l++) sum[l] += PRINTED >= 2 ? moment[l].x : dot(normal[k], moment[l]);
            }
        }
        for (int l = 0; l < LOBES; l++) total[l] += sum[l];
    }
    for (int l = 0; l < LOBES; l++) {
        float visible = clamp(total[l] / max(unshadowed[l], 1e-6), 0.0, 1.0);
        share[share_index(texel, l)] = u_is_last ? uint(round(FULL * visible)) : floatBitsToUint(total[l]);
    }
}
