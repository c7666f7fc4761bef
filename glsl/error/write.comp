// error/write.comp — the coarse levels of the error table: write the records of nodes from the gathered results.
// Python twin: reference.cut_errors

#include "error/coarse.glsl"
#include "error/record.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 2) readonly buffer Gathering { Gathered gathered[]; };

void main() {
    int i = int(gl_GlobalInvocationID.x);
    if (i >= u_count.x * u_count.y) return;
    ivec2 at = u_first + ivec2(i % u_count.x, i / u_count.x);
    Gathered g = gathered[i];
    uvec2 squares = uvec2(g.squares[0], g.squares[1]);
    CellErrors errors;
    errors.max_m = uintBitsToFloat(g.max_m);
    float span_m2 = u_span_m * u_span_m, most_m2 = own_posts(u_which_level, at) * errors.max_m * errors.max_m;
    bool overflows = errors.max_m > u_span_m && most_m2 > exp2(26.0) * span_m2;  // the sum is at most 4 most_m2
    errors.squares_m2 = overflows ? most_m2 : word_float(squares) * exp2(-35.0) * span_m2;
    errors.voids = g.voids;
    write_record(at, node_at(u_which_level, at), errors);
}
