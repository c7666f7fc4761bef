// comparison/clipmap/halve.comp — a level of the pyramid from the level below:
//   every second sample, after a symmetric filter
//   g(i) = Σ w_|d| f(2i + d),   d = −2 … 2,   along columns and along rows.
// If one tap of a pair would lie outside the map, both taps move in. So the filter stays symmetric: it does not change
// planes, and it does not move the rim.   Python twin: comparison.pyramid.halve

#include "comparison/clipmap/pyramid.glsl"

layout(local_size_x = 64) in;
layout(r32f, binding = 0) uniform writeonly image2D u_out;

uniform int u_to;              // the level to compute
uniform ivec2 u_first, u_end;  // its samples, u_end excluded
uniform vec3 u_weights;        // w_0, w_1, w_2

int tap(int middle, int last, int d) { return middle + sign(d) * min(abs(d), min(middle, last - middle)); }

void main() {
    ivec2 to = u_first + ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(to, u_end))) return;
    ivec2 last = last_sample(u_to - 1), middle = min(2 * to, last);
    float sum = 0.0;
    for (int y = -2; y <= 2; y++) {
        float line = 0.0;
        for (int x = -2; x <= 2; x++)
            line += u_weights[abs(x)] * sample_m(u_to - 1, ivec2(tap(middle.x, last.x, x), tap(middle.y, last.y, y)));
        sum += u_weights[abs(y)] * line;
    }
    imageStore(u_out, u_first_texel[u_to].xy + to, vec4(sum));
}
