// sat/spread.comp — phase 2 of an edit: the differences, summed to a table, are added to all words to the right of and
//   below the rectangle's corner. One thread owns a strip of a column.
// Python twin: reference.sat

#include "sat/edit.glsl"

uniform int u_strip;

void main() {
    ivec3 at = ivec3(gl_GlobalInvocationID);
    ivec2 rest = u_size - u_edit_at;
    if (at.x >= rest.x) return;

    Table all = Table(u_first, u_size), edited = Table(0u, u_edit_size);
    int column = min(at.x + 1, u_edit_size.x);
    int end = min((at.y + 1) * u_strip, rest.y);
    for (int y = at.y * u_strip; y < end; y++) {
        WORD change = edit[sat_index(edited, at.z, column, min(y + 1, u_edit_size.y))];
        if (change == WORD(0)) continue;
        uint i = sat_index(all, at.z, u_edit_at.x + at.x + 1, u_edit_at.y + y + 1);
        word[i] = ADD(word[i], change);
    }
}
