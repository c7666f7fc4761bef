// lod/tree.glsl — the quadtree of one view: a bit for each node that is split. Nodes exist whose parent is split; they
// are leaves if they are not split themselves. Cells, level 0, never split.
// Provides split[], is_split(), split_word(), existing_word(), node_of(), project_node(), fan_px(), quad_px().

#include "error/nodes.glsl"
#include "lod/project.glsl"

layout(std430, binding = 0) readonly buffer Nodes { PackedNode node[]; };
layout(std430, binding = 1) buffer Split { uint split[]; };

int words_in_row(int level) { return (u_level[level].size.x + 31) / 32; }

int word_index(int level, int word, int row) { return u_level[level].first_word + row * words_in_row(level) + word; }

bool in_level(int level, ivec2 at) {
    return all(greaterThanEqual(at, ivec2(0))) && all(lessThan(at, u_level[level].size));
}

bool is_split(int level, ivec2 at) {
    if (level == 0 || level > u_top_level || !in_level(level, at)) return false;
    return (split[word_index(level, at.x >> 5, at.y)] >> (at.x & 31) & 1u) != 0u;
}

// The 32 nodes of a row from column 32 · word on: which of them are split.
uint split_word(int level, int word, int row) {
    bool there = level > 0 && row >= 0 && row < u_level[level].size.y && word >= 0 && word < words_in_row(level);
    return there ? split[word_index(level, word, row)] : 0u;
}

// Which of them exist.
uint existing_word(int level, int word, int row) {
    if (level == u_top_level) return 1u;
    uint parents = split[word_index(level + 1, word >> 1, row >> 1)] >> (16 * (word & 1)) & 0xffffu;
    uint both = 0u;
    for (; parents != 0u; parents &= parents - 1u) both |= 3u << 2 * findLSB(parents);
    int columns = u_level[level].size.x - 32 * word;
    return columns < 32 ? both & (1u << columns) - 1u : both;
}

PackedNode node_of(int level, ivec2 at) { return node[node_index(level, at)]; }

// Cells have no range of their own; their parent's holds them.
Projection project_node(int level, ivec2 at, float margin) {
    ivec2 low = at << level, high = min(low + (1 << level), u_last_post);
    int known = max(level, 1);
    vec2 range_m = unpack_range(node_of(known, at >> (known - level)).range);
    return project(box_of(low, high, range_m), margin);
}

float fan_px(Projection p, PackedNode n) { return metric_px(p, unpack_pair(n.max_m).y, posts_rms_m(n).y); }

float quad_px(Projection p, PackedNode n) { return metric_px(p, unpack_pair(n.max_m).x, posts_rms_m(n).x); }
