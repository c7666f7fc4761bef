// sat/scan.comp — phase 2 of a prefix sum: for each strip the sum of all strips before it.
//   9, 22, 21   →   0, 9, 31
// Python twin: reference.sat

#include "sat/lines.glsl"

void main() {
    uint line = gl_GlobalInvocationID.x, layer = gl_GlobalInvocationID.z;
    if (line >= u_lines) return;

    WORD before = WORD(0);
    for (uint strip = 0u; strip < strips(); strip++) {
        uint at = strip_index(line, strip, layer);
        WORD sum = strip_sum[at];
        strip_sum[at] = before;
        before = ADD(before, sum);
    }
}
