// generate/heights.comp — the posts of a band of rows. A post's height depends only on its place. One thread, one post.
// Python twin: reference.land

#include "generate/land.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 0) writeonly buffer Heights { float height[]; };

uniform ivec2 u_size;     // columns and rows of the band
uniform int u_first_row;  // first row of the band in the map
uniform float u_step;     // distance from post to post

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID);
    if (at.x >= u_size.x) return;

    precise vec2 p = vec2(at.x, u_first_row + at.y) * u_step;
    height[at.y * u_size.x + at.x] = land(p);
}
