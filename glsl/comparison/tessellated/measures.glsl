// comparison/tessellated/measures.glsl — the target length of segments in pixels.
//   `u_middle_m` is the eye for which the patches were cut. The picture may be seen from another place.
//   A segment is at least 1 / u_parts of a cell of the map.
// Provides u_edge, u_parts, from_middle_m().   Python twin: comparison.tessellated.MEASURES

#include "blocks/terrain.glsl"

layout(std140, binding = 4) uniform Tessellated {
    vec3 u_middle_m;  // the eye: metres east, north of the post, up from the base
    float u_edge;     // target length of a segment at a distance of one metre
    ivec2 u_middle;   // a post near the eye
    int u_parts;      // 1: all vertices are on posts
};

vec3 from_middle_m(ivec2 post, vec2 between, float h_m) {
    return vec3((vec2(post - u_middle) + between) * vec2(1.0, -1.0) * u_spacing_m, h_m) - u_middle_m;
}
