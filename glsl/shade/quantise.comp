// shade/quantise.comp — heights as steps, as values to be summed: the quantisation range has 65,535 steps.
//   Beyond this range, steps are negative or larger; sums wrap.
//   A step is a difference, a product and a rounding to even. So the bits are the same on every GPU, and in pages.
// Python twin: terrain.steps_of

#include "blocks/terrain.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 0) writeonly buffer Words { uint word[]; };

uniform ivec2 u_first;  // first post
uniform ivec2 u_count;  // columns and rows of posts
uniform int u_first_row;  // first of these rows in this run
uniform float u_steps_per_m;

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, u_first_row);
    if (at.x >= u_count.x) return;
    precise float steps = (height_m(u_first + at) - u_low_m) * u_steps_per_m;
    word[at.y * u_count.x + at.x] = uint(int(roundEven(steps)));
}
