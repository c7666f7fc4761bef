// error/node_errors.glsl — the error of a node's triangles at a post.
//
//    0,0 ──── 2,0      A node is a cell of a patch: two triangles. OpenGL does not say which diagonal they have, so the
//     │ ╲  ╱ │         error is the larger of both. Neighbours may cut its edges: then vertices lie on the posts of
//     │  ╲╱  │         an edge, above or below the straight line between its ends.
//     │  ╱╲  │
//    0,2 ──── 2,2
//
// Provides Node, node_at(), quad_errors_m(), cut_edges_m(), cut_errors_m(), crest_m(), bend_bound_m().
// Python twins: reference.quad_errors, reference.cut_errors, reference.crest, reference.bend_bounds

#include "blocks/terrain.glsl"

struct Node {
    ivec2 low, mid, high;  // posts: north-west corner, centre, south-east corner
    mat3 h;                // h[y][x]: heights relative to h[0][0], which keeps small differences exact
    float base_m;
    vec2 side, per_side;   // posts along a side, and their reciprocals
    bool is_whole;         // the map's rim does not cut the node off, so diagonals run through posts
    float rounding_m;      // bound of rounding errors, besides 2^-19 of an error: docs/precision.md, section 4
};

#ifndef WHOLE_NODES  // true: only whole nodes. Then a node's shape is a constant.
#define WHOLE_NODES false
#endif

// Reciprocals of a whole node's sides are powers of two, so its weights are exact.
#define ROUNDING 16.0
#define ROUNDING_AT_RIM 256.0

Node node_at(int level, ivec2 at) {
    Node n;
    n.low = at << level;
    ivec2 beyond = WHOLE_NODES ? ivec2(1 << level) : u_last_post - n.low;  // posts up to the rim
    ivec2 side = min(ivec2(1 << level), beyond);
    n.mid = n.low + min(ivec2(1 << (level - 1)), beyond);
    n.high = n.low + side;
    n.base_m = height_m(n.low);
    for (int y = 0; y < 3; y++)
        for (int x = 0; x < 3; x++) {
            ivec2 post = ivec2(x == 0 ? n.low.x : x == 1 ? n.mid.x : n.high.x,
                               y == 0 ? n.low.y : y == 1 ? n.mid.y : n.high.y);
            precise float above_base_m = height_m(post) - n.base_m;
            n.h[y][x] = above_base_m;
        }
    n.side = vec2(side);
    n.per_side = 1.0 / n.side;
    n.is_whole = WHOLE_NODES || side == ivec2(1 << level);
    vec3 top = max(max(abs(n.h[0]), abs(n.h[1])), abs(n.h[2]));
    n.rounding_m = max(max(top.x, top.y), top.z) * (n.is_whole ? ROUNDING : ROUNDING_AT_RIM) * exp2(-24.0);
    return n;
}

// The bound of rounding errors is for the order of operations below, so they are `precise`. The functions select
// numbers by the triangle of a post, and have no branches, so that neighbouring threads do not diverge.

// Drawn minus true height with the falling and with the rising diagonal. A place is in posts from the node's corner.
vec2 quad_errors_m(Node n, vec2 place, float h) {
    vec2 t = place * n.per_side;
    float h00 = n.h[0][0], h10 = n.h[0][2], h01 = n.h[2][0], h11 = n.h[2][2];
    precise vec2 falling = t.x >= t.y ? vec2(h10 - h00, h11 - h10) : vec2(h11 - h01, h01 - h00);
    bool is_north = t.x + t.y <= 1.0;  // of the rising diagonal
    precise vec2 rising = is_north ? vec2(h10 - h00, h01 - h00) : vec2(h01 - h11, h10 - h11);
    vec2 u = is_north ? t : 1.0 - t;
    precise float by_falling = h00 + (falling.x * t.x + falling.y * t.y) - h;
    precise float by_rising = (is_north ? h00 : h11) + rising.x * u.x + rising.y * u.y - h;
    return vec2(by_falling, by_rising);
}

// A finer neighbour cuts an edge: the edge gets more vertices, which are posts. CutEdge has the largest distances by
// which they lie above and below the straight line between the edge's ends.
struct CutEdge { float above_m, below_m; };
struct CutEdges { vec4 above_m, below_m; };  // west, north, east, south

CutEdge cut_edge_m(Node n, int side) {
    int axis = side == WEST || side == EAST ? 1 : 0;
    int posts = n.high[axis] - n.low[axis];
    ivec2 post = n.low;
    ivec2 end = n.high;
    post[1 - axis] = end[1 - axis] = (side == WEST || side == NORTH ? n.low : n.high)[1 - axis];
    precise float from = height_m(post) - n.base_m;
    precise float rise = (height_m(end) - n.base_m - from) * n.per_side[axis];
    vec2 most = vec2(0.0);
    for (int i = 1; i < posts; i++) {
        post[axis]++;
        precise float off = height_m(post) - n.base_m - from - rise * float(i);
        most = max(most, vec2(off, -off));
    }
    most = most * (1.0 + exp2(-19.0)) + n.rounding_m;
    return CutEdge(most.x, most.y);
}

CutEdges cut_edges_of(CutEdge west, CutEdge north, CutEdge east, CutEdge south) {
    return CutEdges(vec4(west.above_m, north.above_m, east.above_m, south.above_m),
                    vec4(west.below_m, north.below_m, east.below_m, south.below_m));
}

CutEdges cut_edges_m(Node n) {
    return cut_edges_of(cut_edge_m(n, WEST), cut_edge_m(n, NORTH), cut_edge_m(n, EAST), cut_edge_m(n, SOUTH));
}

float largest_of(vec4 v) { return max(max(v.x, v.y), max(v.z, v.w)); }

// The largest distances of a cell of a patch above and below the truth, whatever edges are cut (docs/guarantee.md,
// section 3). If the new vertices are on the straight lines, the drawn surface lies between the two diagonals. In each
// triangle, only vertices of one cut edge take part. Their weights sum to 1 on that edge, and to 0 on the opposite
// side.
vec2 cut_errors_m(Node n, CutEdges c, vec2 place, vec2 diagonals) {
    vec2 t = place * n.per_side;
    vec4 weights = vec4(1.0 - t, t);  // of west, north, east, south
    return vec2(max(diagonals.x, diagonals.y) + largest_of(weights * c.above_m),
                largest_of(weights * c.below_m) - min(diagonals.x, diagonals.y));
}

// The largest value of a (1 - s) + b s + t s (1 - s), 0 <= s <= 1: errors a and b at both ends of a diagonal, over a
// truth with the twist t.
vec2 crest_m(vec2 a, vec2 b, vec2 t) {
    precise vec2 d = abs(a - b), inside = 0.5 * (a + b) + 0.25 * t + d * d / (4.0 * max(t, 1e-30));
    return mix(max(a, b), inside, greaterThan(t, d));
}

// The bend of two triangles along the diagonal of a node of w × h cells with the twist τ: their planes differ by
// |τ| |x/w − y/h|, so by at most |τ| min(1/w + 1/h, 1) inside one cell that the diagonal crosses.
float bend_bound_m(Node n) {
    if (any(lessThan(n.side, vec2(0.5)))) return 0.0;
    return abs(n.h[0][0] - n.h[0][2] - n.h[2][0] + n.h[2][2]) * min(1.0 / n.side.x + 1.0 / n.side.y, 1.0);
}
