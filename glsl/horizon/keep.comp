// horizon/keep.comp — keep the sun's horizon at the posts of a page, interpolated from the points where lines cross it.
//   Posts of the page outside the map get the horizon of the map's rim.
// Python twin: reference.windowed_sines

#include "horizon/lines.glsl"

layout(local_size_x = 64) in;
layout(r16, binding = 3) readonly uniform image2DArray u_horizons;
RECORDS_IN(u_horizons)
layout(r16, binding = 0) uniform writeonly image2D u_kept;

uniform vec2 u_towards;
uniform ivec2 u_corner;  // of the page in u_kept
uniform int u_side;      // posts a side of the page
uniform int u_apron;     // posts before the page in the window

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (at.x >= u_side) return;
    ivec2 post = clamp(at + u_apron, first_inside(), last_inside());
    imageStore(u_kept, u_corner + at, vec4(record_near(0, u_towards, vec2(post))));
}
