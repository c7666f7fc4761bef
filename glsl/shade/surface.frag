// shade/surface.frag — the first pass of a picture: which place on the map does each sample see?
//   Shading reads the map at that place, in a second pass. So it is done once a pixel, and owes nothing to the mesh.

#include "shade/place.glsl"

in vec2 v_post;
flat in uvec4 v_of_patch;
layout(location = 0) out vec2 out_post;

// From the middle of a pixel to its samples, where all GPUs have them.
const vec2 SAMPLE_AT[4] = vec2[4](vec2(-0.125, -0.375), vec2(0.375, -0.125), vec2(-0.375, 0.125), vec2(0.125, 0.375));

// The place at a sample that the triangle covers: at a ridge, the pixel's middle may be far off, over a void.
vec2 covered_place() {
    vec3 at = vec3(v_post, 1.0) * gl_FragCoord.w;  // linear on the screen
    vec3 right = dFdx(at), up = dFdy(at);
    int covered = gl_SampleMaskIn[0] & 15;
    if (gl_NumSamples != 4 || covered == 15 || covered == 0) return v_post;
    vec2 offset = SAMPLE_AT[findLSB(covered)];
    vec3 moved = at + right * offset.x + up * offset.y;
    return moved.xy / moved.z;
}

void main() {
    Patch p = patch_of(v_of_patch);
    out_post = place_in_patch(v_post, p);
    if (u_has_voids != 0 && is_in_hole(place_in_patch(covered_place(), p))) discard;
}
