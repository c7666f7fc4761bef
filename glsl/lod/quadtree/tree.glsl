// lod/quadtree/tree.glsl — the quadtree of one view: one bit for each node, set if the node is split.
//   A node exists if its parent is split. It is a leaf if it exists and is not split. Cells, level 0, are never split.
// Provides split[], is_split(), split_word(), existing_word(), node_of(), project_node(), fan_max_m(), fan_px(),
// best_fan_px(), quad_px(), ask_for(), ask_for_edges().
// Python twins: reference.tree.existing, reference.quadtree.split_edges

#include "error/nodes.glsl"
#include "lod/project.glsl"

layout(std430, binding = 0) readonly buffer Nodes { PackedNode node[]; };
layout(std430, binding = 6) readonly buffer Ranges { uint range[]; };
// Six parts of equal size: split, CUT_WEST, CUT_NORTH, and the same three as requests.
layout(std430, binding = 1) buffer Split { uint split[]; };

#define CUT_WEST 1   // split edges between leaves of the same size
#define CUT_NORTH 2
#define GRANTED 3    // number of parts before the requests: lod/quadtree/agree.comp
#define STRICTER (1.0 - 1e-5)  // factor of the tolerance: another program may round the same bound differently

int words_in_row(int level) { return (u_level[level].size.x + 31) / 32; }

int word_index(int level, int word, int row) { return u_level[level].first_word + row * words_in_row(level) + word; }

bool in_level(int level, ivec2 at) {
    return all(greaterThanEqual(at, ivec2(0))) && all(lessThan(at, u_level[level].size));
}

bool is_split(int level, ivec2 at) {
    if (level == 0 || level > u_top_level || !in_level(level, at)) return false;
    return (split[word_index(level, at.x >> 5, at.y)] >> (at.x & 31) & 1u) != 0u;
}

bool has_word(int level, int word, int row) {
    return level > 0 && row >= 0 && row < u_level[level].size.y && word >= 0 && word < words_in_row(level);
}

// The split nodes among the 32 nodes of a row from column 32 · word on.
uint split_word(int level, int word, int row) {
    return has_word(level, word, row) ? split[word_index(level, word, row)] : 0u;
}

// The existing nodes among the same 32 nodes.
uint existing_word(int level, int word, int row) {
    if (level == u_top_level) return 1u;
    uint parents = split[word_index(level + 1, word >> 1, row >> 1)] >> (16 * (word & 1)) & 0xffffu;
    uint both = 0u;
    for (; parents != 0u; parents &= parents - 1u) both |= 3u << 2 * findLSB(parents);
    int columns = u_level[level].size.x - 32 * word;
    return columns < 32 ? both & (1u << columns) - 1u : both;
}

int tree_words() {
    return u_level[u_top_level].first_word + words_in_row(u_top_level) * u_level[u_top_level].size.y;
}

// The nodes of a word whose west or north edge is cut.
uint cut_word(int part, int level, int word, int row) {
    return has_word(level, word, row) ? split[part * tree_words() + word_index(level, word, row)] : 0u;
}

void ask_for(int part, int level, ivec2 at) {
    atomicOr(split[(GRANTED + part) * tree_words() + word_index(level, at.x >> 5, at.y)], 1u << (at.x & 31));
}

// W, N, E, S.
void ask_for_edges(int level, ivec2 at, uint edges) {
    if ((edges & 1u) != 0u) ask_for(CUT_WEST, level, at);
    if ((edges & 2u) != 0u) ask_for(CUT_NORTH, level, at);
    if ((edges & 4u) != 0u) ask_for(CUT_WEST, level, at + ivec2(1, 0));
    if ((edges & 8u) != 0u) ask_for(CUT_NORTH, level, at + ivec2(0, 1));
}

PackedNode node_of(int level, ivec2 at) { return node[node_index(level, at)]; }

vec2 range_of(int level, ivec2 at) { return unpack_range(range[node_index(level, at)]); }

// Cells have no record; their parent's range contains them.
Projection project_node(int level, ivec2 at, float margin) {
    ivec2 low = at << level, high = min(low + (1 << level), u_last_post);
    int known = max(level, 1);
    vec2 range_m = range_of(known, at >> (known - level));
    Projection p = project(box_of(low, high, range_m), margin);
    p.sag_m = level > 0 ? sag_m(level) : rounding_between_m();
    return p;
}

vec4 wedges_m(PackedNode n, uint shares) { return unpack_shares(shares, unpack_pair(n.max_m).y); }

// The largest error of a fan with these edges split (bits W, N, E, S).
float fan_max_m(PackedNode n, uint edges) {
    vec4 whole = wedges_m(n, n.whole), split_ = wedges_m(n, n.split), e;
    for (int i = 0; i < 4; i++) e[i] = (edges >> i & 1u) != 0u ? split_[i] : whole[i];
    return max(max(e.x, e.y), max(e.z, e.w));
}

// The record has one mean for the whole fan. It is a bound whatever edges are split.
float fan_px(Projection p, PackedNode n, uint edges) {
    if (u_metric == METRIC_RMS) return metric_px(p, unpack_pair(n.max_m).y, posts_rms_m(n).y);
    float max_m = fan_max_m(n, edges);
    return metric_px(p, max_m, max_m);
}

// The error of a fan with the best choice of edges.
float best_fan_px(Projection p, PackedNode n) {
    if (u_metric == METRIC_RMS) return fan_px(p, n, 0u);
    vec4 e = min(wedges_m(n, n.whole), wedges_m(n, n.split));
    float max_m = max(max(e.x, e.y), max(e.z, e.w));
    return metric_px(p, max_m, max_m);
}

float quad_px(Projection p, PackedNode n) { return metric_px(p, unpack_pair(n.max_m).x, posts_rms_m(n).x); }
