// error/worst.glsl — collect the errors of a node's posts, and of the cells that an edge of the mesh crosses.
//   The order of the sum of squares depends on the node alone, so an edit gives the same bits as a rebuild.
// Provides Worst, worst_of_nothing(), PostErrors, errors_at(), gather_post(), gather_cell(), gather_cells().
// Python twins: reference.node_errors, reference.cut_errors, reference.wedge_errors

#include "error/nodes.glsl"
#include "error/node_errors.glsl"

uniform int u_which_level;
uniform ivec2 u_first;  // first node to compute
uniform ivec2 u_count;  // columns and rows of nodes

struct Worst {
    vec3 max_m;             // as a quad, as a fan, as a cell of a patch with any edges cut
    vec3 squares;           // sums of squares: quad and fan over the node's own posts, the cell over its area
    uint voids;
    vec4 whole_m, split_m;  // errors of the fan's wedges with whole and with split edges
};

Worst worst_of_nothing() { return Worst(vec3(0.0), vec3(0.0), 0u, vec4(0.0), vec4(0.0)); }

// Errors at a post, above and below the truth.
struct PostErrors {
    vec4 drawn;   // of the quad, of the fan
    vec2 cut;     // of a cell of a patch
    vec4 wedge;   // of the wedge that holds the post, with a whole and with a split edge
    uint wedges;  // bits: that wedge; of a cell, the wedges of its posts
    float height_m;
};

// `place` in posts from the node's corner.
PostErrors errors_at(Node n, CutEdges c, ivec2 place) {
    PostErrors e;
    e.height_m = height_m(n.low + place);
    precise float h = e.height_m - n.base_m;
    int wedge;
    vec2 quad = quad_errors_m(n, vec2(place), h);
    vec2 fan = fan_errors_m(n, vec2(place), h, wedge);
    e.drawn = vec4(max(quad.x, quad.y), -min(quad.x, quad.y), max(fan.x, fan.y), -min(fan.x, fan.y));
    e.cut = cut_errors_m(n, c, vec2(place), quad);
    e.wedge = vec4(fan.x, -fan.x, fan.y, -fan.y);
    e.wedges = 1u << wedge;
    return e;
}

vec2 larger(vec4 e) { return max(e.xz, e.yw); }

// Errors, raised by a bound of the rounding errors.
vec4 raised(Node n, vec4 e) { return e * (1.0 + exp2(-19.0)) + n.rounding_m; }

// The errors as a quad, as a fan, and as a cell of a patch.
vec3 most_m(Node n, PostErrors e) { return raised(n, vec4(larger(e.drawn), max(e.cut.x, e.cut.y), 0.0)).xyz; }

void gather(inout Worst w, Node n, PostErrors e) {
    vec4 wedge = raised(n, larger(e.wedge).xxyy);
    bvec4 within = notEqual(e.wedges & uvec4(1u, 2u, 4u, 8u), uvec4(0u));
    w.max_m = max(w.max_m, most_m(n, e));
    w.whole_m = mix(w.whole_m, max(w.whole_m, wedge.xxxx), within);
    w.split_m = mix(w.split_m, max(w.split_m, wedge.zzzz), within);
}

// Posts on the south and east edges belong to the neighbours, except on the map's rim.
bool is_own(Node n, ivec2 place) {
    return all(lessThan(place, n.high - n.low + ivec2(equal(n.high, u_last_post))));
}

// Whether a cell of the node that has data touches a post. If none does, the node draws no land at the post, and the
// post belongs to the land of neighbours. But the node's own posts always count: a post may lie alone among voids.
#ifdef NO_VOIDS
bool meets_data(Node n, ivec2 place) { return true; }
#else
bool meets_data(Node n, ivec2 place) {
    for (int i = 0; i < 4; i++) {
        ivec2 cell = place - ivec2(i & 1, i >> 1);
        bool is_in_node = all(greaterThanEqual(cell, ivec2(0))) && all(lessThan(n.low + cell, n.high));
        if (is_in_node && !is_hole(n.low + cell)) return true;
    }
    return false;
}
#endif

// The part of the cells around a post that are cells of the node: 1, 1/2 on its edges, 1/4 at its corners.
float share_of(Node n, ivec2 place) {
    vec2 on_edge = vec2(equal(place, ivec2(0))) + vec2(equal(place, n.high - n.low));
    return (1.0 - 0.5 * on_edge.x) * (1.0 - 0.5 * on_edge.y);
}

void gather_post(inout Worst w, Node n, PostErrors at, ivec2 place) {
    bool is_filled = is_void(n.low + place);
    w.voids |= uint(is_filled);
    if (is_filled) return;
    vec3 e = most_m(n, at);
    bool own = is_own(n, place);
    if (own) w.squares.xy += e.xy * e.xy;
    if (own || meets_data(n, place)) {
        w.squares.z += share_of(n, place) * e.z * e.z;
        gather(w, n, at);
    }
}

// The largest error over a cell of the map is at a post, or on its diagonal from a to b: docs/guarantee.md, section 1.
vec4 over_halves(vec4 worst, vec4 a, vec4 b, float twist) {
    return max(worst, crest_m(a, b, vec4(twist, -twist, twist, -twist)));
}

// If one triangle covers a cell, its error is largest at a post. This function is for a cell that an edge of the mesh
// crosses. In a square node, the edge is the cell's diagonal from a to b. In a node that the map's rim cuts off, an
// edge may cross any cell between its posts. Then the twist adds |t|/4 at most, and the bend adds kink_m.
// Over the cell, the two triangles are off by |t|/√90 = 0.10541 |t| in the root mean square, and over the places that
// are measured by up to |t| √(13/1024) = 0.11268 |t|: docs/guarantee.md.
void gather_cell(inout Worst w, Node n, PostErrors a, PostErrors b, PostErrors c, PostErrors d, vec2 kink_m) {
    PostErrors worst = a;
    worst.drawn = max(max(a.drawn, b.drawn), max(c.drawn, d.drawn));
    worst.cut = max(max(a.cut, b.cut), max(c.cut, d.cut));
    worst.wedge = max(max(a.wedge, b.wedge), max(c.wedge, d.wedge));
    precise float twist = (a.height_m - c.height_m) - (d.height_m - b.height_m);
    float bend = 0.25 * abs(twist);
    PostErrors most = worst;
    most.drawn += bend + kink_m.xxyy;
    most.cut += bend + kink_m.x;
    most.wedge += bend + kink_m.y;
    if (is_square(n)) {
        most.drawn = over_halves(worst.drawn, a.drawn, b.drawn, twist);
        most.cut = over_halves(worst.cut.xyxy, a.cut.xyxy, b.cut.xyxy, twist).xy;
        most.wedge = over_halves(worst.wedge, a.wedge, b.wedge, twist);
    }
    most.wedges = a.wedges | b.wedges | c.wedges | d.wedges;
    gather(w, n, most);
    vec3 mean = abs(twist) * vec3(0.10541, 0.10541, 0.11268) + kink_m.xyx + n.rounding_m;
    w.squares += mean * (2.0 * most_m(n, worst) + mean);
}

// The cells from place `low` up to place `end` that an edge of the mesh may cross: those on the diagonals of a square
// node, and all cells of a node that the map's rim cuts off. Software renderers execute a branch for every cell, so the
// loop visits only these cells.
void gather_cells(inout Worst w, Node n, CutEdges cuts, ivec2 low, ivec2 end) {
    bool square = is_square(n);
    vec2 kink = square ? vec2(0.0) : kinks_m(n);
    int side = n.high.x - n.low.x;
    int width = end.x - low.x;
    int falling = max(low.x, low.y);  // first columns on the diagonals
    int rising = max(low.x, side - end.y);
    int on_falling = max(min(end.x, end.y) - falling, 0);
    int on_rising = max(min(end.x, side - low.y) - rising, 0);
    int cells = square ? on_falling + on_rising : width * (end.y - low.y);
    for (int i = 0; i < cells; i++) {
        int rises = int(square && i >= on_falling);
        int column = i + (rises == 0 ? falling : rising - on_falling);
        ivec2 on_diagonal = ivec2(column, rises == 0 ? column : side - 1 - column);
        ivec2 cell = square ? on_diagonal : low + ivec2(i % width, i / width);
        if (is_hole(n.low + cell)) continue;
        PostErrors a = errors_at(n, cuts, cell + ivec2(0, rises));
        PostErrors b = errors_at(n, cuts, cell + ivec2(1, 1 - rises));
        PostErrors c = errors_at(n, cuts, cell + ivec2(1, rises));
        PostErrors d = errors_at(n, cuts, cell + ivec2(0, 1 - rises));
        gather_cell(w, n, a, b, c, d, kink);
    }
}
