// lod/quadtree/balance.comp — let neighbours differ by at most one level: if a node is split, the parents of its
//   neighbours are split, too. One dispatch for each level, from the finest up. Bits are only added, so the order does
//   not matter. (Von Herzen, Barr 1987, "Accurate triangulations of deformed, intersecting surfaces".)
// Python twin: reference.tree.balance

#include "lod/quadtree/tree.glsl"

layout(local_size_x = GROUP) in;

uniform int u_which_level;

void split_parents(int word, int row, uint bits) {
    int columns = u_level[u_which_level + 1].size.x;
    if (bits == 0u || row < 0 || row >= u_level[u_which_level + 1].size.y || word < 0 || 32 * word >= columns) return;
    if (columns - 32 * word < 32) bits &= (1u << columns - 32 * word) - 1u;
    atomicOr(split[word_index(u_which_level + 1, word, row)], bits);
}

// The even bits, 0, 2, 4, ..., packed into the lower 16.
uint pairs(uint bits) {
    bits &= 0x55555555u;
    bits = (bits | bits >> 1) & 0x33333333u;
    bits = (bits | bits >> 2) & 0x0f0f0f0fu;
    bits = (bits | bits >> 4) & 0x00ff00ffu;
    return (bits | bits >> 8) & 0xffffu;
}

void main() {
    int row = int(gl_GlobalInvocationID.y), word = int(gl_GlobalInvocationID.x);
    if (word >= words_in_row(u_which_level)) return;
    uint bits = split[word_index(u_which_level, word, row)];
    if (bits == 0u) return;

    // the nodes' own parents, the parents west of even columns, and those east of odd columns
    uint even = pairs(bits), odd = pairs(bits >> 1), own = even | odd;
    int shift = 16 * (word & 1);
    uint here = (own | even >> 1 | odd << 1) & 0xffffu;
    split_parents(word >> 1, row >> 1, here << shift);
    if ((even & 1u) != 0u) split_parents((16 * word - 1) >> 5, row >> 1, 1u << ((16 * word - 1) & 31));
    if ((odd & 0x8000u) != 0u) split_parents((word + 1) >> 1, row >> 1, 1u << ((16 * word + 16) & 31));
    split_parents(word >> 1, (row & 1) == 0 ? (row >> 1) - 1 : (row >> 1) + 1, own << shift);
}
