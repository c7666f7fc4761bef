// sat/columns.comp — sums along columns for a renderer with few threads: each row is added to the row below it.
//   A group owns a band of columns and walks down it, ROWS rows at a time. So it reads memory in order.
//   Threads of a group are side by side, and step through the band together. With FOURS, each takes four words at a
//   time: all rows begin at a multiple of four words.
// Python twin: reference.sat

#define THREADS 8u
#define ROWS 8u
#include "sat/lines.glsl"

uniform uint u_band;  // words in a row of a band
uniform uint u_row;   // first row of this run, not 0; the rows above it are summed already
uniform uint u_end;   // the row after the last

void main() {
    uint left = gl_WorkGroupID.x * u_band, right = min(left + u_band, u_lines);
    for (uint row = u_row; row < u_end; row += ROWS) {
        uint below = min(u_end - row, ROWS);
        for (uint line = left + gl_LocalInvocationID.x; line < right; line += THREADS) {
            uint at = word_index(line, row, gl_GlobalInvocationID.z);
            WORD sum = word[at - u_word_step], rows[ROWS];
            for (uint r = 0u; r < ROWS; r++) rows[r] = word[at + min(r, below - 1u) * u_word_step];
            for (uint r = 0u; r < ROWS; r++) {
                sum = ADD(sum, rows[r]);
                if (r < below) word[at + r * u_word_step] = sum;
            }
        }
    }
}
