// error/worst.glsl — collect the errors of a node's posts, and of the cells that an edge of the mesh crosses.
//   The order of the sum of squares depends on the node alone, so an edit gives the same bits as a rebuild.
// Provides Worst, worst_of_nothing(), PostErrors, errors_at(), gather_post(), gather_cell(), gather_cells().
// Python twins: reference.node_errors, reference.cut_errors, reference.wedge_errors

#include "error/nodes.glsl"
#include "error/node_errors.glsl"

uniform int u_which_level;
uniform ivec2 u_first;  // first node to compute; then columns and rows of nodes
uniform ivec2 u_count;

struct Worst {
    vec2 max_m;    // quad, fan
    vec2 cut_m;    // with any edges cut: of a cell of a patch, of a patch of 2 × 2 segments
    vec4 squares;  // quad, fan, and these two
    uint voids;
    vec4 turned_m; // of a cell of a star, its diagonal toward each corner
    vec4 whole_m, split_m;  // errors of the fan's wedges with whole and with split edges
};

Worst worst_of_nothing() { return Worst(vec2(0.0), vec2(0.0), vec4(0.0), 0u, vec4(0.0), vec4(0.0), vec4(0.0)); }

// Errors at a post, above and below: of the quad and of the fan; of a cell and of a fan with cut edges; of the wedge with a whole and with a split edge.
struct PostErrors {
    vec4 drawn, cut, wedge;
    Turned turned;
    uint wedges;  // bits: the wedge that contains the post
    float height_m;
};

// `place` in posts from the node's corner.
PostErrors errors_at(Node n, CutEdges c, ivec2 place) {
    PostErrors e;
    e.height_m = height_m(n.low + place);
    float h = e.height_m - n.base_m;
    int wedge;
    vec2 weights, quad = quad_errors_m(n, vec2(place), h), fan = fan_errors_m(n, vec2(place), h, wedge, weights);
    e.drawn = vec4(max(quad.x, quad.y), -min(quad.x, quad.y), max(fan.x, fan.y), -min(fan.x, fan.y));
    e.cut = cut_errors_m(n, c, vec2(place), quad, fan.y, weights, e.turned);
    e.wedge = vec4(fan.x, -fan.x, fan.y, -fan.y);
    e.wedges = 1u << wedge;
    return e;
}

// Largest errors of the quad and of the fan, or of the wedge's two edges; of both with cut edges. A cell alone is a fan with any edges whole.
vec2 larger(vec4 e) { return max(e.xz, e.yw); }
vec4 largest(vec4 drawn, vec4 cut) { return vec4(larger(drawn), max(largest_of(cut), larger(drawn).y), larger(cut).y); }

vec4 raised(Node n, vec4 e) { return e * (1.0 + exp2(-20.0)) + n.rounding_m; }  // by what floats may have lost

// Returns the errors of quad, fan, cell of a patch, and patch of 2 × 2 segments.
vec4 gather(inout Worst w, Node n, PostErrors e) {
    vec4 most = raised(n, largest(e.drawn, e.cut));
    vec4 wedge = raised(n, larger(e.wedge).xxyy);
    bvec4 within = notEqual(e.wedges & uvec4(1u, 2u, 4u, 8u), uvec4(0u));
    w.max_m = max(w.max_m, most.xy);
    w.cut_m = max(w.cut_m, most.zw);
    w.turned_m = max(w.turned_m, raised(n, max(e.turned.above_m, e.turned.below_m)));
    w.whole_m = mix(w.whole_m, max(w.whole_m, wedge.xxxx), within);
    w.split_m = mix(w.split_m, max(w.split_m, wedge.zzzz), within);
    return most;
}

// Posts on the south and east edges belong to the neighbours, except on the map's rim.
bool is_own(Node n, ivec2 place) { return all(lessThan(place, n.high - n.low + ivec2(equal(n.high, u_last_post)))); }

void gather_post(inout Worst w, Node n, PostErrors at, ivec2 place) {
    bool is_filled = is_void(n.low + place);
    w.voids |= uint(is_filled);
    if (is_filled) return;
    vec4 e = gather(w, n, at);
    if (is_own(n, place)) w.squares += e * e;
}

// The largest of them over the cell: docs/guarantee.md, section 1. Within each half they are largest at a post or on the diagonal from a to b.
vec4 over_halves(vec4 worst, vec4 a, vec4 b, vec4 t) { return max(worst, crest_m(a, b, t)); }

// Errors above and below of the two corners whose diagonal falls, or rises.
vec4 on_diagonal(Turned e, bool falls) { return falls ? vec4(e.above_m.xz, e.below_m.xz) : vec4(e.above_m.yw, e.below_m.yw); }

// If one triangle covers a cell, its error is largest at a post. This is for a cell that an edge of the mesh crosses: in a square node its diagonal
// from a to b. In a node that the map's rim cuts off it may cross any cell, between its posts; then the twist adds |t|/4 at most, and the bend kink_m.
void gather_cell(inout Worst w, Node n, PostErrors a, PostErrors b, PostErrors c, PostErrors d, bool falls, vec2 kink_m) {
    PostErrors worst = a, most;
    worst.drawn = max(max(a.drawn, b.drawn), max(c.drawn, d.drawn));
    worst.cut = max(max(a.cut, b.cut), max(c.cut, d.cut));
    worst.wedge = max(max(a.wedge, b.wedge), max(c.wedge, d.wedge));
    float twist = (a.height_m - c.height_m) - (d.height_m - b.height_m), bend = 0.25 * abs(twist);
    vec4 twists = vec4(twist, -twist, twist, -twist);
    most.drawn = is_square(n) ? over_halves(worst.drawn, a.drawn, b.drawn, twists) : worst.drawn + bend + kink_m.xxyy;
    most.cut = is_square(n) ? over_halves(worst.cut, a.cut, b.cut, twists) : worst.cut + bend + kink_m.xxyy;
    most.wedge = is_square(n) ? over_halves(worst.wedge, a.wedge, b.wedge, twists) : worst.wedge + bend + kink_m.y;
    vec4 over = crest_m(on_diagonal(a.turned, falls), on_diagonal(b.turned, falls), vec4(twist, twist, -twist, -twist));
    vec2 of_corners = max(over.xy, over.zw);
    most.turned = Turned(falls ? vec4(of_corners.x, 0.0, of_corners.y, 0.0) : vec4(0.0, of_corners.x, 0.0, of_corners.y), vec4(0.0));
    most.wedges = a.wedges | b.wedges | c.wedges | d.wedges;
    gather(w, n, most);
    vec4 mean = abs(twist) * 0.10541 + vec4(kink_m, max(kink_m.x, kink_m.y), kink_m.y);
    w.squares += mean * (2.0 * largest(worst.drawn, worst.cut) + mean);
}

// The cells from place `low` up to place `end` that an edge of the mesh may cross: those on the diagonals of a square node; of a node that the
// map's rim cuts off, all. Software renderers execute a branch for every cell, so the loop visits only these.
void gather_cells(inout Worst w, Node n, CutEdges cuts, ivec2 low, ivec2 end) {
    bool square = is_square(n);
    vec2 kink = square ? vec2(0.0) : kinks_m(n);
    int side = n.high.x - n.low.x, width = end.x - low.x;
    int falling = max(low.x, low.y), rising = max(low.x, side - end.y);  // first columns on the diagonals
    int on_falling = max(min(end.x, end.y) - falling, 0), on_rising = max(min(end.x, side - low.y) - rising, 0);
    int cells = square ? on_falling + on_rising : width * (end.y - low.y);
    for (int i = 0; i < cells; i++) {
        int rises = int(square && i >= on_falling), column = i + (rises == 0 ? falling : rising - on_falling);
        ivec2 cell = square ? ivec2(column, rises == 0 ? column : side - 1 - column) : low + ivec2(i % width, i / width);
        if (is_hole(n.low + cell)) continue;
        PostErrors a = errors_at(n, cuts, cell + ivec2(0, rises)), b = errors_at(n, cuts, cell + ivec2(1, 1 - rises));
        PostErrors c = errors_at(n, cuts, cell + ivec2(1, rises)), d = errors_at(n, cuts, cell + ivec2(0, 1 - rises));
        gather_cell(w, n, a, b, c, d, rises == 0, kink);
    }
}
