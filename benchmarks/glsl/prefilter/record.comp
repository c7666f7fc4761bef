// prefilter/record.comp — the values of each cell for the mipmaps of other prefilters:
//   normal, slopes, their squares and product, and the visible share of the sun.

#include "horizon/lines.glsl"
#include "horizon/cell.glsl"
#include "horizon/disc.glsl"

layout(local_size_x = 64) in;
layout(r16, binding = 3) readonly uniform image2DArray u_horizons;
RECORDS_IN(u_horizons)
layout(rgba32f, binding = 0) uniform writeonly image2D u_normals;
layout(rgba32f, binding = 1) uniform writeonly image2D u_slopes;
layout(rgba32f, binding = 2) uniform writeonly image2D u_products;

uniform vec2 u_towards;

void main() {
    ivec2 cell = ivec2(gl_GlobalInvocationID.xy);
    if (cell.x >= u_last_post.x) return;
    vec3 n = normal_of_cell(cell);
    vec2 slope = -n.xy / n.z;
    float seen = disc_share(sine_of(record_near(0, u_towards, vec2(cell) + 0.5)));
    imageStore(u_normals, cell, vec4(n, seen));
    imageStore(u_slopes, cell, vec4(slope, slope * slope));
    imageStore(u_products, cell, vec4(slope.x * slope.y, 0.0, 0.0, 0.0));
}
