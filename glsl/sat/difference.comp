// sat/difference.comp — phase 1 of an edit: new values minus old ones, which are recovered from the table.
// Python twin: reference.sat

#include "sat/edit.glsl"

#define WORD_AT(i) word[i]
BOX_SUM(old_sum, WORD, WORD_AT, SUB)

void main() {
    ivec3 at = ivec3(gl_GlobalInvocationID);
    if (at.x >= u_edit_size.x) return;

    ivec2 cell = u_edit_at + at.xy;
    uint i = sat_index(Table(0u, u_edit_size), at.z, at.x + 1, at.y + 1);
    edit[i] = SUB(edit[i], old_sum(Table(u_first, u_size), at.z, cell, cell + 1));
}
