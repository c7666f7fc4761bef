// lod/again.comp — decide whether another round of lod/agree.comp is needed. If lod/commit.comp changed the tree, it is, and
// the tiles are listed again. If not, the last list is that of the final tree. One thread.
// Python twin: reference.lod.agree

#include "lod/dispatch.glsl"
#include "lod/tiles.glsl"

layout(local_size_x = 1) in;

uniform bool u_start;

void main() {
    if (!u_start && is_over()) return;
    bool on = u_start || s_asked != 0u;
    dispatch(on);
    s_asked = 0u;
    if (on) active_groups = NO_GROUPS;
    asking_groups = NO_GROUPS;
}
