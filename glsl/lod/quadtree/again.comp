// lod/quadtree/again.comp — decide whether another round of lod/quadtree/agree.comp is needed.
//   If lod/quadtree/commit.comp changed the tree, another round runs, and the tiles are listed again.
//   If not, the last list of tiles is that of the final tree. One thread.
// Python twin: reference.quadtree.agree

#include "lod/quadtree/dispatch.glsl"
#include "lod/quadtree/tiles.glsl"

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
