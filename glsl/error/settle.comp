// error/settle.comp — the coarse levels of the error table: write the records of nodes from the gathered results.
// Python twins: reference.node_errors, reference.wedge_errors

#include "error/coarse.glsl"
#include "error/record.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 2) readonly buffer Gathering { Gathered gathered[]; };

void main() {
    int i = int(gl_GlobalInvocationID.x);
    if (i >= u_count.x * u_count.y) return;
    ivec2 at = u_first + ivec2(i % u_count.x, i / u_count.x);
    Gathered g = gathered[i];
    vec4 share;
    for (int i = 0; i < 4; i++) share[i] = word_float(uvec2(g.squares[2 * i], g.squares[2 * i + 1]));
    vec4 squares = share * exp2(-35.0) * u_span_m * u_span_m;
    vec4 most[4];  // quad, fan and both with cut edges; wedges, whole; wedges, split; as cells of a star
    for (int i = 0; i < 16; i++) most[i / 4][i % 4] = uintBitsToFloat(g.most[i]);
    settle_node(at, node_at(u_which_level, at), Worst(most[0].xy, most[0].zw, squares, g.voids, most[3], most[1], most[2]));
}
