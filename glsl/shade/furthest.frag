// shade/furthest.frag — near plane over view depth of the furthest sample of each pixel; 0 for the sky.

#include "shade/seen.glsl"

out float out_depth;

void main() {
    out_depth = 1.0;
    for (int i = 0; i < SAMPLES; i++) out_depth = min(out_depth, texelFetch(u_depth, ivec2(gl_FragCoord.xy), i).x);
}
