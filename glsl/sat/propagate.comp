// sat/propagate.comp — phase 3 of a prefix sum: sum up each strip, starting with the sum of all strips before it.
//   0 │ 3 1 4 1 │  9 │ 5 9 2 6 │  31 │ 5 3 5 8 │   →   │ 3 4 8 9 │ 14 23 25 31 │ 36 39 44 52 │
//   Software renderers read a vector of a thread in one go: four words of a row cost little more than one.
// Python twin: reference.sat

#include "sat/lines.glsl"

void main() {
    uint line = gl_GlobalInvocationID.x, strip = gl_GlobalInvocationID.y, layer = gl_GlobalInvocationID.z;
    if (line >= u_lines) return;

#ifdef WHOLE_LINES
    WORD sum = WORD(0);
#else
    WORD sum = strip == 0u ? WORD(0) : strip_sum[strip_index(line, strip, layer)];
#endif
    uint end = min((strip + 1u) * u_strip, u_length);
    uint at = word_index(line, strip * u_strip, layer);
    for (uint i = strip * u_strip; i < end; i++, at += u_word_step) {
#ifdef WHOLE_LINES
        if (u_word_step == 1u && at % 4u == 0u && i + 4u <= end) {
            FOUR f = four[at / 4u];
            for (int k = 0; k < 4; k++) f[k] = sum = ADD(sum, f[k]);
            four[at / 4u] = f;
            i += 3u, at += 3u;
            continue;
        }
#endif
        sum = ADD(sum, word[at]);
        word[at] = sum;
    }
}
