// error/worst.glsl — collect the errors of a node's posts, then write its record and its gain.
//   The order of the sum of squares depends on the node alone, so an edit gives the same bits as a rebuild.
// Provides Worst, worst_of_nothing(), gather_post(), settle_node().
// Python twins: reference.node_errors, reference.cut_errors, reference.wedge_errors

#include "error/nodes.glsl"
#include "error/node_errors.glsl"
#include "error/gain.glsl"

layout(std430, binding = 0) buffer Nodes { PackedNode node[]; };
layout(std430, binding = 4) buffer Ranges { NodeRange range[]; };

uniform int u_which_level;
uniform ivec2 u_first;  // first node to compute; then columns and rows of nodes
uniform ivec2 u_count;

struct Worst {
    vec2 max_m;    // quad, fan
    vec2 cut_m;    // with any edges cut: of a cell of a patch, of a patch of 2 × 2 segments
    vec4 squares;  // quad, fan, and these two
    uint voids;
    vec4 whole_m, split_m;  // errors of the fan's wedges with whole and with split edges
};

Worst worst_of_nothing() { return Worst(vec2(0.0), vec2(0.0), vec4(0.0), 0u, vec4(0.0), vec4(0.0)); }

// Posts on the south and east edges belong to the neighbours, except on the map's rim.
bool is_own(Node n, ivec2 post) {
    return all(lessThan(post, n.high + ivec2(equal(n.high, u_last_post))));
}

float raised(Node n, float e) { return e * (1.0 + exp2(-20.0)) + n.rounding_m; }  // by what floats may have lost

void gather_post(inout Worst w, Node n, CutEdges c, ivec2 post) {
    if (is_void(post)) {
        w.voids = 1u;
        return;
    }
    float h = height_m(post) - n.base_m;
    int wedge;
    vec2 weights, quad = quad_errors_m(n, post, h), fan = fan_errors_m(n, post, h, wedge, weights);
    vec2 e = vec2(raised(n, max(-quad.x, quad.y)), raised(n, max(abs(fan.x), abs(fan.y))));
    w.max_m = max(w.max_m, e);
    vec4 bounds = cut_errors_m(n, c, post, quad, fan.y, weights);
    vec2 cut = vec2(max(raised(n, largest_of(bounds)), e.y), raised(n, max(bounds.z, bounds.w)));  // a cell alone is a fan with any edges whole
    w.cut_m = max(w.cut_m, cut);
    w.whole_m[wedge] = max(w.whole_m[wedge], raised(n, abs(fan.x)));
    w.split_m[wedge] = max(w.split_m[wedge], raised(n, abs(fan.y)));
    if (is_own(n, post)) w.squares += vec4(e * e, cut * cut);
}

// Errors at the four posts of a crossed cell, above and below: of the quad and of the fan; of a cell with cut edges; of the fan's wedges with
// whole and with split edges.
struct Corner { vec4 drawn, cut, wedge; };

// The largest of them over the cell: docs/guarantee.md, section 1. Within each half they are largest at a post or on the diagonal.
vec4 over_halves(vec4 worst, vec4 a, vec4 b, float t) { return max(worst, crest_m(a, b, vec4(t, -t, t, -t))); }

// If one triangle covers a cell, its error is largest at a post. This is for a cell that an edge of the mesh crosses: a diagonal of a square
// node. In a node that the map's rim cuts off it may cross any cell, between its posts; then the twist adds |t|/4 at most, and the bend kink_m.
void gather_cell(inout Worst w, Node n, CutEdges c, ivec2 cell, vec2 kink_m) {
    if (is_hole(cell)) return;
    Corner corner[4], worst = Corner(vec4(-1e30), vec4(-1e30), vec4(-1e30));
    bvec4 wedges = bvec4(false);
    for (int i = 0; i < 4; i++) {
        ivec2 post = cell + ivec2(i & 1, i >> 1);
        float h = height_m(post) - n.base_m;
        int wedge;
        vec2 weights, quad = quad_errors_m(n, post, h), fan = fan_errors_m(n, post, h, wedge, weights);
        wedges[wedge] = true;
        corner[i].drawn = vec4(quad.y, -quad.x, max(fan.x, fan.y), -min(fan.x, fan.y));
        corner[i].cut = cut_errors_m(n, c, post, quad, fan.y, weights);
        corner[i].wedge = vec4(fan.x, -fan.x, fan.y, -fan.y);
        worst = Corner(max(worst.drawn, corner[i].drawn), max(worst.cut, corner[i].cut), max(worst.wedge, corner[i].wedge));
    }
    float twist = twist_m(cell);
    bool is_falling = cell.x - n.low.x == cell.y - n.low.y;
    Corner a = is_falling ? corner[0] : corner[1], b = is_falling ? corner[3] : corner[2], most = worst;
    float t = is_falling ? twist : -twist;
    most.drawn = is_square(n) ? over_halves(worst.drawn, a.drawn, b.drawn, t) : worst.drawn + 0.25 * abs(twist) + kink_m.xxyy;
    most.cut = is_square(n) ? over_halves(worst.cut, a.cut, b.cut, t) : worst.cut + 0.25 * abs(twist) + kink_m.xxyy;
    most.wedge = is_square(n) ? over_halves(worst.wedge, a.wedge, b.wedge, t) : worst.wedge + 0.25 * abs(twist) + kink_m.y;
    w.max_m = max(w.max_m, vec2(raised(n, max(most.drawn.x, most.drawn.y)), raised(n, max(most.drawn.z, most.drawn.w))));
    w.cut_m = max(w.cut_m, vec2(raised(n, max(largest_of(most.cut), max(most.drawn.z, most.drawn.w))), raised(n, max(most.cut.z, most.cut.w))));
    for (int wedge = 0; wedge < 4; wedge++) if (wedges[wedge]) {
        w.whole_m[wedge] = max(w.whole_m[wedge], raised(n, max(most.wedge.x, most.wedge.y)));
        w.split_m[wedge] = max(w.split_m[wedge], raised(n, max(most.wedge.z, most.wedge.w)));
    }
    vec4 mean = abs(twist) * 0.10541 + vec4(kink_m, max(kink_m.x, kink_m.y), kink_m.y);
    vec4 at_posts = vec4(max(worst.drawn.x, worst.drawn.y), max(worst.drawn.z, worst.drawn.w), largest_of(worst.cut), max(worst.cut.z, worst.cut.w));
    at_posts.z = max(at_posts.z, at_posts.y);
    w.squares += mean * (2.0 * at_posts + mean);
}

// The cells from post `low` up to post `end` that an edge of the mesh may cross: those on the diagonals of a square node; of a node that the
// map's rim cuts off, all. Software renderers execute a branch for every cell, so the loop visits only these.
void gather_cells(inout Worst w, Node n, CutEdges c, ivec2 low, ivec2 end) {
    bool square = is_square(n);
    vec2 kink = square ? vec2(0.0) : kinks_m(n);
    ivec2 from = low - n.low, to = end - n.low;
    int side = n.high.x - n.low.x, width = to.x - from.x;
    int falling = max(from.x, from.y), rising = max(from.x, side - to.y);  // first columns on the diagonals
    int on_falling = max(min(to.x, to.y) - falling, 0), on_rising = max(min(to.x, side - from.y) - rising, 0);
    int cells = square ? on_falling + on_rising : width * (to.y - from.y);
    for (int i = 0; i < cells; i++) {
        int column = i < on_falling ? falling + i : rising + i - on_falling;
        ivec2 on_diagonal = ivec2(column, i < on_falling ? column : side - 1 - column);
        gather_cell(w, n, c, n.low + (square ? on_diagonal : from + ivec2(i % width, i / width)), kink);
    }
}

vec2 range_of_posts(Node n) {
    vec2 range = vec2(n.h[0][0]);
    for (int y = 0; y < 3; y++)
        for (int x = 0; x < 3; x++) range = vec2(min(range.x, n.h[y][x]), max(range.y, n.h[y][x]));
    return range + n.base_m;
}

// Positive half floats compare like integers.
void nest_child(inout PackedNode n, PackedNode child) {
    n.max_m = (n.max_m & 0xffffu) | max(n.max_m >> 16, child.max_m >> 16) << 16;
    n.rms_m = (n.rms_m & 0xffffu) | max(n.rms_m >> 16, child.rms_m >> 16) << 16;
}

uint nest_range(uint a, uint b) { return min(a & 0xffffu, b & 0xffffu) | max(a >> 16, b >> 16) << 16; }

// A cell of the map, as two triangles: it has errors only between its posts.
float cell_square_m2(ivec2 cell) {
    float t_m = is_hole(cell) ? 0.0 : twist_m(cell);
    return t_m * t_m / 90.0;
}

void settle_node(ivec2 at, Node n, Worst w) {
    ivec2 own = n.high - n.low + ivec2(equal(n.high, u_last_post));
    // a thread adds up to 33 × 33 squares in floats: each addition may lose 2^-24 of the sum
    vec4 rms_m = sqrt(w.squares / (float(own.x) * float(own.y))) * (1.0 + exp2(-14.0));
    uint has_voids = w.voids != 0u ? HAS_VOIDS : 0u;
    uint rms = pack_pair(min(rms_m.xy, w.max_m)) | has_voids, cut = pack_pair(vec2(w.cut_m.x, min(rms_m.z, w.cut_m.x)));
    PackedNode settled = PackedNode(cut, rms, pack_pair(w.max_m), 0u, 0u);
    uint heights = 0xffffu;
    ivec2 last = min(2 * at + 1, u_level[u_which_level - 1].size - 1), parts = last + 1 - 2 * at;
    float parts_m2 = 0.0, nested_gain = 0.0;
    if (u_which_level == 1) heights = pack_range(range_of_posts(n));
    for (int y = 2 * at.y; y <= last.y; y++)
        for (int x = 2 * at.x; x <= last.x; x++) {
            if (u_which_level == 1) {
                parts_m2 += cell_square_m2(ivec2(x, y));
                continue;
            }
            int i = node_index(u_which_level - 1, ivec2(x, y));
            nest_child(settled, node[i]);
            heights = nest_range(heights, range[i].heights);
            parts_m2 += squares_m2(node[i], u_which_level - 1, ivec2(x, y)).x;
            nested_gain = max(nested_gain, gain[i]);
        }
    settled.whole = pack_shares(w.whole_m, unpack_pair(settled.max_m).y);
    settled.split = pack_shares(w.split_m, unpack_pair(settled.max_m).y);
    int i = node_index(u_which_level, at);
    node[i] = settled;
    range[i] = NodeRange(heights, pack_pair(vec2(w.cut_m.y, min(rms_m.w, w.cut_m.y))));
    // computed from the rounded record, so that a gain is always the same
    vec2 leaf_m2 = squares_m2(settled, u_which_level, at);
    float fan_triangles = 4.0 - float(n.mid.x == n.high.x) - float(n.mid.y == n.high.y);
    gain[i] = max(nested_gain, split_gain(leaf_m2.x, leaf_m2.y, fan_triangles, parts_m2, 2.0 * float(parts.x * parts.y)));
}
