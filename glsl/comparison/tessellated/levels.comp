// comparison/tessellated/levels.comp — the levels of each patch: every edge is cut by its length on the screen.
//   An edge's length on the screen is the projected diameter of its bounding sphere,
//   which is the same from all directions:
//       T = ⌈ K |b − a| / z / edge_px ⌉
//   a and b are its ends on the ground, z is the depth of its middle, K the focal length in pixels
//   (Cantlay 2011, "DirectX 11 Terrain Tessellation", NVIDIA).
//   No segment is shorter than the spacing of the posts, or than 1 / u_parts of it:
//   see comparison/tessellated/measures.glsl. Both patches at an edge compute the same number. If the neighbour is
//   finer, each half of the edge is an edge of its own.

#include "comparison/tessellated/patch.glsl"
#include "comparison/tessellated/measures.glsl"
#include "blocks/view.glsl"

#define MOST 32  // segments of an edge: two halves make 64, the limit of the hardware

layout(local_size_x = 64) in;
// Column and row on the level's lattice; level; bits of the edges with a finer neighbour: west, north, east, south.
layout(std430, binding = 0) readonly buffer Places { ivec4 place[]; };
layout(std430, binding = 1) writeonly buffer Cuts { uvec4 cut[]; };
layout(std430, binding = 2) buffer Count { uint triangles; };

uniform int u_patches;

vec3 ground_from_eye_m(ivec2 post) { return from_middle_m(post, vec2(0.0), height_m(post)); }

// The depth of a place, but at least the depth that a place as far away has in a corner of the picture.
float depth_of(vec3 from_eye) {
    float away = length(from_eye);
    vec2 extent = abs(u_centre) + u_half_extent;
    float depth_m = max(dot(from_eye, u_forward.xyz), away * inversesqrt(1.0 + dot(extent, extent)));
    return max(depth_m, near_m());
}

int segments(ivec2 a, ivec2 b) {
    vec3 from = ground_from_eye_m(a), to = ground_from_eye_m(b);
    float wanted = ceil(distance(from, to) / (u_edge * depth_of(0.5 * (from + to))));
    int posts = b.x - a.x + b.y - a.y;
    return whole_parts(int(clamp(wanted, 1.0, float(min(MOST, posts * u_parts)))), posts, MOST);
}

// Cut edge i, from a to b. If it consists of two halves, the first half has `half_` posts.
void cut_edge(inout Cut c, int i, ivec2 a, ivec2 b, bool is_two, int half_) {
    ivec2 along = sign(b - a), middle = a + half_ * along;
    is_two = is_two && b.x - a.x + b.y - a.y > half_;
    c.first_half[i] = is_two ? segments(a, middle) : 0;
    c.outer[i] = is_two ? c.first_half[i] + segments(middle, b) : segments(a, b);
}

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= uint(u_patches)) return;
    ivec4 p = place[i];
    int side = 1 << p.z;
    Cut c;
    c.low = p.xy * side;
    ivec2 high = min(c.low + side, u_last_post);
    c.size = high - c.low;
    ivec2 south_west = ivec2(c.low.x, high.y), north_east = ivec2(high.x, c.low.y);
    cut_edge(c, 0, c.low, south_west, (p.w & 1) != 0, side / 2);
    cut_edge(c, 1, c.low, north_east, (p.w & 2) != 0, side / 2);
    cut_edge(c, 2, north_east, high, (p.w & 4) != 0, side / 2);
    cut_edge(c, 3, south_west, high, (p.w & 8) != 0, side / 2);
    cut[i] = words_of(c);
    atomicAdd(triangles, uint(triangles_in(c, u_parts == 1)));
}
