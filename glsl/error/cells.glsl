// error/cells.glsl — collect the errors of a node's posts, and of the cells that an edge of the mesh crosses.
//   The order of the sum of squares depends on the node alone, so an edit gives the same bits as a rebuild.
// Provides CellErrors, no_errors(), PostErrors, errors_at(), gather_post(), gather_cell(), gather_cells().
// Python twin: reference.cut_errors

#include "error/nodes.glsl"
#include "error/node_errors.glsl"

uniform int u_which_level;
uniform ivec2 u_first;  // first node to compute
uniform ivec2 u_count;  // columns and rows of nodes

// Errors of a node as a cell of a patch, whatever edges are cut.
struct CellErrors {
    float max_m;
    float squares_m2;  // sum over the node's area
    uint voids;        // whether a post is void
};

CellErrors no_errors() { return CellErrors(0.0, 0.0, 0u); }

struct PostErrors {
    vec2 cut_m;  // largest distances above and below the truth
    float height_m;
};

// `place` in posts from the node's corner.
PostErrors errors_at(Node n, CutEdges c, ivec2 place) {
    float height = height_m(n.low + place);
    precise float h = height - n.base_m;
    return PostErrors(cut_errors_m(n, c, vec2(place), quad_errors_m(n, vec2(place), h)), height);
}

// The larger error, raised by a bound of the rounding errors.
float raised_m(Node n, vec2 cut_m) { return max(cut_m.x, cut_m.y) * (1.0 + exp2(-19.0)) + n.rounding_m; }

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

void gather_post(inout CellErrors errors, Node n, PostErrors at, ivec2 place) {
    bool is_filled = is_void(n.low + place);
    errors.voids |= uint(is_filled);
    if (is_filled || !(is_own(n, place) || meets_data(n, place))) return;
    float e_m = raised_m(n, at.cut_m);
    errors.squares_m2 += share_of(n, place) * e_m * e_m;
    errors.max_m = max(errors.max_m, e_m);
}

// If one triangle covers a cell, its error is largest at a post. This function is for a cell that an edge of the mesh
// crosses. In a whole node, the edge is the cell's diagonal from a to b. Then the largest error is at a post or on this
// diagonal: docs/guarantee.md, section 1. In a node that the map's rim cuts off, an edge may cross any cell between its
// posts. Then the twist adds |t|/4 at most, and the bend adds bend_m.
// Over the cell, the two triangles are off by |t|/√90 = 0.10541 |t| in the root mean square. Over the places where
// mesh/error.frag measures, it is up to |t| √(13/1024) = 0.11268 |t|: docs/guarantee.md.
void gather_cell(
    inout CellErrors errors, Node n, PostErrors a, PostErrors b, PostErrors c, PostErrors d, float bend_m
) {
    vec2 worst_m = max(max(a.cut_m, b.cut_m), max(c.cut_m, d.cut_m));
    precise float twist = (a.height_m - c.height_m) - (d.height_m - b.height_m);
    vec2 most_m = n.is_whole ? max(worst_m, crest_m(a.cut_m, b.cut_m, vec2(twist, -twist)))
        : worst_m + (0.25 * abs(twist) + bend_m);
    errors.max_m = max(errors.max_m, raised_m(n, most_m));
    float mean_m = abs(twist) * 0.11268 + bend_m + n.rounding_m;
    errors.squares_m2 += mean_m * (2.0 * raised_m(n, worst_m) + mean_m);
}

// The cells from place `low` up to place `end` that an edge of the mesh may cross: those on the diagonals of a whole
// node, and all cells of a node that the map's rim cuts off. Software renderers execute a branch for every cell, so the
// loop visits only these cells.
void gather_cells(inout CellErrors errors, Node n, CutEdges cuts, ivec2 low, ivec2 end) {
    float bend_m = n.is_whole ? 0.0 : bend_bound_m(n);
    int side = n.high.x - n.low.x;
    int width = end.x - low.x;
    int falling = max(low.x, low.y);  // first columns on the diagonals
    int rising = max(low.x, side - end.y);
    int on_falling = max(min(end.x, end.y) - falling, 0);
    int on_rising = max(min(end.x, side - low.y) - rising, 0);
    int cells = n.is_whole ? on_falling + on_rising : width * (end.y - low.y);
    for (int i = 0; i < cells; i++) {
        int rises = int(n.is_whole && i >= on_falling);
        int column = i + (rises == 0 ? falling : rising - on_falling);
        ivec2 on_diagonal = ivec2(column, rises == 0 ? column : side - 1 - column);
        ivec2 cell = n.is_whole ? on_diagonal : low + ivec2(i % width, i / width);
        if (is_hole(n.low + cell)) continue;
        PostErrors a = errors_at(n, cuts, cell + ivec2(0, rises));
        PostErrors b = errors_at(n, cuts, cell + ivec2(1, 1 - rises));
        PostErrors c = errors_at(n, cuts, cell + ivec2(1, rises));
        PostErrors d = errors_at(n, cuts, cell + ivec2(0, 1 - rises));
        gather_cell(errors, n, a, b, c, d, bend_m);
    }
}
