// sat/reduce.comp — phase 1 of a prefix sum: the sum of each strip.
//   │ 3 1 4 1 │ 5 9 2 6 │ 5 3 5 8 │   →   9, 22, 21
// Python twin: reference.sat

#include "sat/lines.glsl"

void main() {
    uint line = gl_GlobalInvocationID.x, strip = gl_GlobalInvocationID.y, layer = gl_GlobalInvocationID.z;
    if (line >= u_lines) return;

    WORD sum = WORD(0);
    uint end = min((strip + 1u) * u_strip, u_length);
    uint at = word_index(line, strip * u_strip, layer);
    for (uint i = strip * u_strip; i < end; i++, at += u_word_step) sum = ADD(sum, word[at]);
    strip_sum[strip_index(line, strip, layer)] = sum;
}
