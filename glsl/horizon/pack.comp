// horizon/pack.comp — pack the shares of all lobes into one texel before they are summed: one fetch reads them all.
//   Word i of a texel holds lobes 3i, 3i + 1 and 3i + 2, ten bits each.
// Python twin: reference.pack_shares

#ifndef LOBES
#define LOBES 4
#define FULL 4095.0  // share of 1
#endif

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Shares { uint share[]; };
layout(rgba32ui, binding = 0) uniform writeonly uimage2D u_packed;

uniform ivec2 u_texels, u_corner;  // the texels of a page are a part of a larger texture

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy), size = u_texels;
    if (texel.x >= size.x) return;
    uvec4 words = uvec4(0u);
    for (int l = 0; l < LOBES; l++) {
        float part = float(share[(l * size.y + texel.y) * size.x + texel.x]) / FULL;
        words[l / 3] |= uint(round(1023.0 * part)) << 10 * (l % 3);
    }
    imageStore(u_packed, u_corner + texel, words);
}
