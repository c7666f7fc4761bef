// horizon/sunlit.comp — the sunlight that each cell gets, ready to be summed: share of the disc times cosine.
//   Their product is stored, not each for itself: slopes that turn away from the sun are the ones in shadow, and the mean
//   of a product is not the product of means. Python twin: reference.sunlit

#include "horizon/lines.glsl"
#include "horizon/cell.glsl"
#include "horizon/disc.glsl"

#ifndef FULL
#define FULL 4095.0
#endif

layout(local_size_x = 64) in;
layout(binding = 2) uniform sampler2DArray u_horizons;
layout(std430, binding = 0) writeonly buffer Sunlit { uint sunlit[]; };

uniform vec2 u_towards;
uniform vec3 u_sun;

void main() {
    ivec2 cell = ivec2(gl_GlobalInvocationID.xy);
    if (cell.x >= u_last_post.x) return;
    float share = disc_share(sine_of(record_near(u_horizons, 0, u_towards, vec2(cell) + 0.5)), 0.0);
    float light = share * max(dot(normal_of_cell(cell), u_sun), 0.0);
    sunlit[cell.y * u_last_post.x + cell.x] = uint(round(FULL * light));
}
