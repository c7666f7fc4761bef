// error/write.comp — the coarse levels of the error table: write the records of nodes from the gathered results.
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
    Worst w;
    for (int k = 0; k < 3; k++) {
        w.max_m[k] = uintBitsToFloat(g.most[k]);
        w.squares[k] = word_float(uvec2(g.squares[2 * k], g.squares[2 * k + 1])) * exp2(-35.0) * u_span_m * u_span_m;
    }
    for (int k = 0; k < 4; k++) {
        w.whole_m[k] = uintBitsToFloat(g.most[3 + k]);
        w.split_m[k] = uintBitsToFloat(g.most[7 + k]);
    }
    w.voids = g.voids;
    write_record(at, node_at(u_which_level, at), w);
}
