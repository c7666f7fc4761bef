// shade/surface.frag — the first pass of a picture if cells with voids are holes. It stores only depth.

#include "shade/place.glsl"
#include "shade/sample_at.glsl"

in vec2 v_post;
flat in uvec4 v_of_patch;

// The place at the centre of the samples that the triangle covers. The pixel's centre may be outside the triangle. Its
// place may then be over a void behind a ridge, or several cells away, if the triangle is small, flat and far away.
vec2 covered_place() {
    int covered = gl_SampleMaskIn[0] & 15;
    vec3 at = vec3(v_post, 1.0) * gl_FragCoord.w;  // linear on the screen
    vec3 right = dFdx(at), up = dFdy(at);
    if (gl_NumSamples != 4 || covered == 15 || covered == 0) return v_post;
    vec2 offset = vec2(0.0);
    for (int i = 0; i < 4; i++) offset += float(covered >> i & 1) * SAMPLE_AT[i];
    vec3 moved = at + mat2x3(right, up) * offset / float(bitCount(covered));
    return moved.xy / moved.z;
}

void main() {
    if (is_in_hole(place_in_patch(covered_place(), patch_of(v_of_patch)))) discard;
}
