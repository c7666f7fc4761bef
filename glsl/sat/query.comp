// sat/query.comp — the sums over a list of boxes, one thread for each box.
// Python twin: reference.box_sum

#include "sat/word.glsl"
#include "sat/box.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Words { WORD word[]; };
layout(std430, binding = 1) readonly buffer Boxes { ivec4 box[]; };  // a, b
layout(std430, binding = 2) writeonly buffer Sums { WORD sum[]; };

uniform uint u_boxes;
uniform uint u_first;
uniform ivec2 u_size;
uniform int u_layer;

#define WORD_AT(i) word[i]
BOX_SUM(box_sum, WORD, WORD_AT, SUB)

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < u_boxes) sum[i] = box_sum(Table(u_first, u_size), u_layer, box[i].xy, box[i].zw);
}
