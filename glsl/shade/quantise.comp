// shade/quantise.comp — heights as 16-bit steps of the map's span, as values to be summed.

#include "shade/steps.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 0) writeonly buffer Words { uint word[]; };

uniform ivec2 u_first;  // first post; then columns and rows of posts
uniform ivec2 u_count;
uniform int u_first_row;  // of them, in this run

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, u_first_row);
    if (at.x >= u_count.x) return;
    word[at.y * u_count.x + at.x] = uint(clamp(round(steps_from_m(height_m(u_first + at))), 0.0, 65535.0));
}
