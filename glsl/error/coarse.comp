// error/coarse.comp — the coarse levels of the error table, in three steps (u_step) of one program:
//   CUT     one thread for each edge of a node: how far its posts lie off the straight lines between its corners. If an
//           edit changes neither these distances nor a vertex of the node, the errors of the node's other posts stay as
//           they are
//   GATHER  one thread for each fine node of a node: visits its posts, if they may have changed, and adds their errors
//   WRITE   one thread for each node: writes the record
//   Positive floats compare like their bits, and sums are integers. So the order of the threads does not matter.
// Python twins: reference.cut_errors, reference.cut_edges

#include "error/coarse.glsl"
#include "error/record.glsl"

#define CUT 0
#define GATHER 1
#define WRITE 2

layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 2) buffer Gathering { Gathered gathered[]; };  // one entry for each node; zero at the start

uniform int u_step;
uniform ivec4 u_posts;  // the posts that have changed: first column and row, last column and row

bool changes(ivec2 low, ivec2 high) {
    return all(lessThanEqual(low, u_posts.zw)) && all(greaterThanEqual(high, u_posts.xy));
}

// Whether a vertex of the node has changed: then the errors of all posts of the node have changed, too.
bool vertex_changes(Node n) {
    for (int i = 0; i < 9; i++) {
        ivec2 post = ivec2(i % 3 == 0 ? n.low.x : i % 3 == 1 ? n.mid.x : n.high.x,
                           i / 3 == 0 ? n.low.y : i / 3 == 1 ? n.mid.y : n.high.y);
        if (changes(post, post)) return true;
    }
    return false;
}

Gathered gathered_of(CellErrors errors) {
    uvec2 sum = square_up(errors.squares_m2 / u_span_m / u_span_m);
    return Gathered(floatBitsToUint(errors.max_m), uint[2](sum.x, sum.y), errors.voids);
}

CellErrors errors_of_fine(Node n, ivec2 at, ivec2 low) {
    ivec2 end = min(low + FINE_SIDE, n.high);
    end += ivec2(equal(end, n.high));  // the far edge
    int k = cut_index(at);
    CutEdges c = cut_edges_of(cut_edge[k], cut_edge[k + 1], cut_edge[k + 2], cut_edge[k + 3]);
    CellErrors errors = no_errors();
    for (int y = low.y; y < end.y; y++)
        for (int x = low.x; x < end.x; x++) {
            ivec2 place = ivec2(x, y) - n.low;
            gather_post(errors, n, errors_at(n, c, place), place);
        }
    gather_cells(errors, n, c, low - n.low, min(low + FINE_SIDE, n.high) - n.low);
    return errors;
}

int number_of(ivec2 node_) { return (node_.y - u_first.y) * u_count.x + node_.x - u_first.x; }

void cut(ivec2 thread) {
    ivec2 at = u_first + ivec2(thread.x >> 2, thread.y);
    if (any(greaterThanEqual(at - u_first, u_count))) return;
    int edge = thread.x & 3, k = cut_index(at) + edge;
    CutEdge cut = cut_edge_m(node_at(u_which_level, at), edge);
    if (cut != cut_edge[k]) has_changed[number_of(at)] = 1u;
    cut_edge[k] = cut;
}

void gather(ivec2 thread) {
    ivec2 in_node = thread % fine_in_node();
    ivec2 at = u_first + thread / fine_in_node(), fine = at * fine_in_node() + in_node;
    if (any(greaterThanEqual(thread / fine_in_node(), u_count))) return;
    if (any(greaterThanEqual(fine, u_level[FINE_LEVELS].size))) return;
    Node n = node_at(u_which_level, at);
    ivec2 low = fine * FINE_SIDE;
    int node_ = number_of(at), i = contribution_index(fine);
    // a void makes holes of the cells around it
    if (has_changed[node_] != 0u || vertex_changes(n) || changes(low - 1, min(low + FINE_SIDE, n.high)))
        contribution[i] = gathered_of(errors_of_fine(n, at, low));
    Gathered g = contribution[i];
    atomicMax(gathered[node_].max_m, g.max_m);
    ATOMIC_ADD_64(gathered[node_].squares, uvec2(g.squares[0], g.squares[1]));
    atomicOr(gathered[node_].voids, g.voids);
}

void write(ivec2 thread) {
    if (any(greaterThanEqual(thread, u_count))) return;
    ivec2 at = u_first + thread;
    Gathered g = gathered[number_of(at)];
    CellErrors errors;
    errors.max_m = uintBitsToFloat(g.max_m);
    float span_m2 = u_span_m * u_span_m, most_m2 = own_posts(u_which_level, at) * errors.max_m * errors.max_m;
    bool overflows = errors.max_m > u_span_m && most_m2 > exp2(26.0) * span_m2;  // the sum is at most 4 most_m2
    float squares = word_float(uvec2(g.squares[0], g.squares[1]));
    errors.squares_m2 = overflows ? most_m2 : squares * exp2(-35.0) * span_m2;
    errors.voids = g.voids;
    write_record(at, node_at(u_which_level, at), errors);
}

void main() {
    ivec2 thread = ivec2(gl_GlobalInvocationID.xy);
    if (u_step == CUT) cut(thread);
    else if (u_step == GATHER) gather(thread);
    else write(thread);
}
