// shade/coverage.frag — the share of a pixel's samples that see the ground; near plane over view depth of the furthest
// sample, 0 for the sky.

#include "shade/seen.glsl"

out vec2 out_seen;

void main() {
    out_seen = vec2(0.0, 1.0);
    for (int i = 0; i < SAMPLES; i++) {
        float depth = texelFetch(u_depth, ivec2(gl_FragCoord.xy), i).x;
        out_seen = vec2(out_seen.x + float(depth > 0.0) / float(SAMPLES), min(out_seen.y, depth));
    }
}
