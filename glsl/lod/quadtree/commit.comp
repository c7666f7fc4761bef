// lod/quadtree/commit.comp — apply the requests of lod/quadtree/agree.comp, and record whether there were any.
//   One thread for each word; the groups form a rectangle, because a row of them may be longer than OpenGL allows.
// Python twin: reference.quadtree.agree

#include "lod/quadtree/tree.glsl"
#include "lod/quadtree/summary.glsl"

layout(local_size_x = GROUP) in;

void main() {
    int i = int(gl_WorkGroupID.y * gl_NumWorkGroups.x * uint(GROUP) + gl_GlobalInvocationID.x);
    if (i >= GRANTED * tree_words()) return;
    uint asked = split[GRANTED * tree_words() + i] & ~split[i];
    split[GRANTED * tree_words() + i] = 0u;
    if (asked == 0u) return;
    split[i] |= asked;
    s_asked = 1u;
}
