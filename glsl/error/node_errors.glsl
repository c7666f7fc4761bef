// error/node_errors.glsl — the error of a node's triangles at a post, for every way to draw the node.
//
//    quad, either diagonal        fan around the centre, each edge whole or split
//    0,0 ──── 2,0                 0,0 ── 1,0 ── 2,0
//     │ ╲  ╱ │                     │  ╲   │   ╱  │
//     │  ╲╱  │                    0,1 ── 1,1 ── 2,1
//     │  ╱╲  │                     │  ╱   │   ╲  │
//    0,2 ──── 2,2                 0,2 ── 1,2 ── 2,2
//
//   OpenGL does not say which diagonal a quad gets, so its error is the larger of both. Each edge of a fan may be whole
//   or split. So a post has two errors, one for each state of its wedge's edge.
// Provides Node, node_at(), is_square(), quad_errors_m(), fan_errors_m(), cut_edges_m(), cut_errors_m(),
// crest_m(), kinks_m().
// Python twins: reference.node_errors, reference.cut_errors, reference.crest, reference.kinks

#include "blocks/terrain.glsl"

struct Node {
    ivec2 low, mid, high;  // posts: north-west corner, centre, south-east corner
    mat3 h;                // h[y][x]: heights relative to h[0][0], which keeps small differences exact
    float base_m;
    vec2 before, after;    // posts from the corner to the centre, and from there to the far corner
    vec2 per_before, per_after, per_side;  // their reciprocals, and that of their sum
    float rounding_m;      // bound of rounding errors, besides 2^-19 of an error: docs/precision.md, section 3
};

#ifndef WHOLE_NODES  // true: only nodes that the map's rim does not cut off. Then a node's shape is a constant.
#define WHOLE_NODES false
#endif

// Whether diagonals run through posts: not if the map's rim cuts the node off.
bool is_square(Node n) { return n.before == n.after && n.before.x == n.before.y; }

// Reciprocals of a square node's sides are powers of two, so its weights are exact.
#define ROUNDING 16.0
#define ROUNDING_AT_RIM 256.0

Node node_at(int level, ivec2 at) {
    Node n;
    n.low = at << level;
    ivec2 beyond = WHOLE_NODES ? ivec2(1 << level) : u_last_post - n.low;  // posts up to the rim
    ivec2 before = min(ivec2(1 << (level - 1)), beyond), side = min(ivec2(1 << level), beyond);
    n.mid = n.low + before;
    n.high = n.low + side;
    n.base_m = height_m(n.low);
    for (int y = 0; y < 3; y++)
        for (int x = 0; x < 3; x++) {
            ivec2 post = ivec2(x == 0 ? n.low.x : x == 1 ? n.mid.x : n.high.x,
                               y == 0 ? n.low.y : y == 1 ? n.mid.y : n.high.y);
            precise float above_base_m = height_m(post) - n.base_m;
            n.h[y][x] = above_base_m;
        }
    n.before = vec2(before);
    n.after = vec2(side - before);
    n.per_before = 1.0 / n.before;
    n.per_after = 1.0 / max(n.after, 1.0);
    n.per_side = 1.0 / (n.before + n.after);
    vec3 top = max(max(abs(n.h[0]), abs(n.h[1])), abs(n.h[2]));
    float roundings = WHOLE_NODES || is_square(n) ? ROUNDING : ROUNDING_AT_RIM;
    n.rounding_m = max(max(top.x, top.y), top.z) * roundings * exp2(-24.0);
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

// Drawn minus true height in the wedge between the centre and one edge, with the edge whole and with it split. w is
// the centre's weight. a, m and b are the heights at one end, the middle and the other end of the edge; d is the
// distance of the post from the middle, in posts along the edge.
vec2 wedge_errors_m(Node n, int axis, vec3 edge, float w, float d, float h) {
    float a = edge[0], m = edge[1], b = edge[2], v = 1.0 - w;
    precise float above = w * n.h[1][1] - h;
    float u = v * n.before[axis] + d;
    precise float whole = above + v * a + (b - a) * u * n.per_side[axis];
    bool is_first = d <= 0.0;  // the post is beside the first half of the edge
    precise float from = v * (is_first ? a : m), rise = is_first ? m - a : b - m;
    precise float halves = above + (from + rise * (is_first ? u : d) * (is_first ? n.per_before : n.per_after)[axis]);
    return vec2(whole, halves);
}

// Drawn minus true height with the edge of the post's wedge whole, and with it split.
vec2 fan_errors_m(Node n, vec2 place, float h, out int wedge) {
    vec2 d = place - n.before;
    bvec2 is_low = lessThanEqual(d, vec2(0.0));  // west, north of the centre
    vec2 w = 1.0 + mix(-d * n.per_after, d * n.per_before, is_low);  // the smaller one is the centre's weight
    vec3 west = vec3(n.h[0][0], n.h[1][0], n.h[2][0]), east = vec3(n.h[0][2], n.h[1][2], n.h[2][2]);
    bool is_row = w.y <= w.x;  // the edge runs along a row
    vec3 edge = is_row ? (is_low.y ? n.h[0] : n.h[2]) : (is_low.x ? west : east);
    wedge = is_row ? (is_low.y ? NORTH : SOUTH) : (is_low.x ? WEST : EAST);
    int axis = is_row ? 0 : 1;
    return wedge_errors_m(n, axis, edge, min(w.x, w.y), d[axis], h);
}

// A finer neighbour cuts an edge: the edge gets more vertices, which are posts. Move has the largest distances by which
// they lie above and below the straight line between the edge's ends.
struct Move { float above_m, below_m; };
struct CutEdges { vec4 above_m, below_m; };  // west, north, east, south

Move cut_edge_m(Node n, int side) {
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
    return Move(most.x, most.y);
}

CutEdges cut_edges_of(Move west, Move north, Move east, Move south) {
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
vec4 crest_m(vec4 a, vec4 b, vec4 t) {
    precise vec4 d = abs(a - b), inside = 0.5 * (a + b) + 0.25 * t + d * d / (4.0 * max(t, 1e-30));
    return mix(max(a, b), inside, greaterThan(t, d));
}

// A bound of the bend of two triangles along the diagonal of a rectangle of w × h cells with the twist τ: their planes
// differ by |τ| |x/w − y/h|, so by at most |τ| min(1/w + 1/h, 1) inside one cell that the diagonal crosses.
float bend_m(float tau, vec2 cells) {
    return any(lessThan(cells, vec2(0.5))) ? 0.0 : abs(tau) * min(1.0 / cells.x + 1.0 / cells.y, 1.0);
}

// bend_m() of a node as a quad, and as a fan. In a fan, each quarter between the centre and a corner counts, with each
// of its two outer edges whole or split.
vec2 kinks_m(Node n) {
    vec2 kink = vec2(bend_m(n.h[0][0] - n.h[0][2] - n.h[2][0] + n.h[2][2], n.before + n.after), 0.0);
    for (int y = 0; y <= 2; y += 2)
        for (int x = 0; x <= 2; x += 2) {
            float row = mix(n.h[y][0], n.h[y][2], n.before.x * n.per_side.x);
            float column = mix(n.h[0][x], n.h[2][x], n.before.y * n.per_side.y);
            vec2 cells = vec2(x == 0 ? n.before.x : n.after.x, y == 0 ? n.before.y : n.after.y);
            for (int i = 0; i < 4; i++) {
                float along_row = (i & 1) == 0 ? n.h[y][1] : row, along_column = (i & 2) == 0 ? n.h[1][x] : column;
                kink.y = max(kink.y, bend_m(n.h[y][x] + n.h[1][1] - along_row - along_column, cells));
            }
        }
    return kink;
}
