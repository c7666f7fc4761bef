// error/drawing.glsl — how far a node's triangles stray from a post, whichever way the node is drawn.
//
//    quad, either diagonal        fan around the centre, each edge whole or split
//    0,0 ──── 2,0                 0,0 ── 1,0 ── 2,0
//     │ ╲  ╱ │                     │  ╲   │   ╱  │        OpenGL does not say which diagonal a quad gets, and a fan's
//     │  ╲╱  │                    0,1 ── 1,1 ── 2,1       neighbours decide which of its edges are split: the error
//     │  ╱╲  │                     │  ╱   │   ╲  │        of a post is the worst over all of that.
//    0,2 ──── 2,2                 0,2 ── 1,2 ── 2,2
//
// Provides Node, node_at(), quad_error_m(), fan_error_m(), rounding_m().  Python twin: reference.drawing_errors

#include "blocks/terrain.glsl"

struct Node {
    ivec2 low, mid, high;  // posts: north-west corner, centre, south-east corner
    mat3 h;                // h[y][x]: heights there, above h[0][0] to keep the small differences exact
    float base_m;
};

Node node_at(int level, ivec2 at) {
    Node n;
    n.low = at << level;
    n.mid = min(n.low + (1 << (level - 1)), u_last_post);
    n.high = min(n.low + (1 << level), u_last_post);
    n.base_m = height_m(n.low);
    for (int y = 0; y < 3; y++)
        for (int x = 0; x < 3; x++) {
            ivec2 post = ivec2(x == 0 ? n.low.x : x == 1 ? n.mid.x : n.high.x,
                               y == 0 ? n.low.y : y == 1 ? n.mid.y : n.high.y);
            n.h[y][x] = height_m(post) - n.base_m;
        }
    return n;
}

// What float arithmetic may have swallowed: a few units in the last place of the node's relief.
float rounding_m(Node n) {
    vec3 top = max(max(abs(n.h[0]), abs(n.h[1])), abs(n.h[2]));
    return max(max(top.x, top.y), top.z) * exp2(-21.0);
}

float quad_error_m(Node n, ivec2 post, float h) {
    vec2 t = vec2(post - n.low) / vec2(n.high - n.low);
    float h00 = n.h[0][0], h10 = n.h[0][2], h01 = n.h[2][0], h11 = n.h[2][2];
    float falling = t.x >= t.y ? h00 + (h10 - h00) * t.x + (h11 - h10) * t.y : h00 + (h01 - h00) * t.y + (h11 - h01) * t.x;
    float rising = t.x + t.y <= 1.0 ? h00 + (h10 - h00) * t.x + (h01 - h00) * t.y
                                    : h11 + (h01 - h11) * (1.0 - t.x) + (h10 - h11) * (1.0 - t.y);
    return max(abs(falling - h), abs(rising - h));
}

// In the wedge between the centre and one edge; w is the centre's weight, `along` runs along the edge from its end a
// over its middle m to its end b, `before` and `after` are the lengths on the two sides of the middle.
float wedge_error_m(float centre, vec3 edge, float w, float along, float before, float after, float h) {
    float a = edge[0], m = edge[1], b = edge[2];
    float u = (1.0 - w) * before + along;
    float whole = w * centre + (1.0 - w) * a + (b - a) * u / (before + after);
    float halves = along <= 0.0 ? w * centre + (1.0 - w) * a + (m - a) * u / before
                                : w * centre + (1.0 - w) * m + (b - m) * along / after;
    return max(abs(whole - h), abs(halves - h));
}

float fan_error_m(Node n, ivec2 post, float h) {
    vec2 d = vec2(post - n.mid), before = vec2(n.mid - n.low), after = vec2(n.high - n.mid);
    bool west = d.x <= 0.0, north = d.y <= 0.0;
    float wx = west ? 1.0 + d.x / before.x : 1.0 - d.x / after.x;
    float wy = north ? 1.0 + d.y / before.y : 1.0 - d.y / after.y;
    if (wy <= wx) return wedge_error_m(n.h[1][1], north ? n.h[0] : n.h[2], wy, d.x, before.x, after.x, h);
    vec3 edge = west ? vec3(n.h[0][0], n.h[1][0], n.h[2][0]) : vec3(n.h[0][2], n.h[1][2], n.h[2][2]);
    return wedge_error_m(n.h[1][1], edge, wx, d.y, before.y, after.y, h);
}
