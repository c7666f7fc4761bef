// error/coarse.glsl — where many threads add up the errors of one large node.
//   Maxima of positive floats compare as their bits do; sums are integers: the order does not matter.
// Provides gathered[], gathered_index().

#include "error/worst.glsl"

struct Gathered {
    uint max_q, max_f;  // float bits
    uint squares[4];    // quad low, high; fan low, high: fixed point (error/nodes.glsl)
    uint voids;
};
layout(std430, binding = 1) buffer Gathering { Gathered gathered[]; };

int gathered_index(ivec2 at) { return (at.y - u_first.y) * u_count.x + at.x - u_first.x; }
