// sat/spread.comp — phase 2 of an edit, after the differences were summed to a table of their own: add it to all that
// stands right of and below the rectangle's corner.

#include "sat/edit.glsl"

void main() {
    ivec3 at = ivec3(gl_GlobalInvocationID);
    if (at.x >= u_size.x - u_edit_at.x) return;

    ivec2 inside = min(at.xy + 1, u_edit_size);
    uint i = sat_index(Table(u_first, u_size), at.z, u_edit_at.x + at.x + 1, u_edit_at.y + at.y + 1);
    word[i] = ADD(word[i], edit[sat_index(Table(0u, u_edit_size), at.z, inside.x, inside.y)]);
}
