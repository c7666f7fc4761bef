// lod/rings/agree.comp — one round in which neighbours agree on the vertices of their common edges.
//   A finer neighbour cuts the common edge. The bound of a leaf holds whatever edges are cut (error/node_errors.glsl),
//   so most leaves stay as they are. But an edge has at most 64 segments: a leaf that would need more is split in four.
//   All threads look at the leaves as the round before left them, so their order does not matter. Leaves only become
//   finer, so the rounds come to an end. The first round looks at all leaves. Each later round looks at the leaves that
//   have changed, and at all leaves along their edges. So the last round that looks at a leaf stores its final edges.
//   One thread handles one leaf.

#include "lod/rings/leaf.glsl"
#include "lod/rings/edges.glsl"

layout(local_size_x = LEAF_GROUP) in;

uniform bool u_priced;  // a price decides, and no tolerance: parts keep the spacing of the whole

void append_leaf(int id) {
    uint k = atomicAdd(b_leaves.count, 1u);
    listed[k].leaf = uint(id);
    atomicMax(b_leaves.groups, k / uint(LEAF_GROUP) + 1u);
}

// Queue a leaf for the next round, at most once: its stamp is the last round for which it was queued, and all stamps of
// earlier views are lower than u_first_stamp. The leaf may be split before that round begins. So the entry also has
// the size of the square that the leaf covers now; `id` is the square's first unit.
void append_to_queue(int id, uint word) {
    int next_round = u_agreed + 1;
    uint its_stamp = u_first_stamp + uint(next_round);
    if (atomicMax(listed[id].stamp, its_stamp) == its_stamp) return;
    uint k = atomicAdd(b_queue[next_round & 7].count, 1u);
    listed[k].in_queue[next_round & 1] = uint(id) | uint(side_units_log2(word)) << 28;
    atomicMax(b_queue[next_round & 7].groups, k / uint(LEAF_GROUP) + 1u);
}

int queued_id(uint entry) { return int(entry & 0xfffffffu); }
int queued_units_log2(uint entry) { return int(entry >> 28); }  // of the square's side

// Unit i of a square of units, as an offset from its first one.
int unit_in(int units_log2, int i) { return (i >> units_log2) * 8 + (i & (1 << units_log2) - 1); }

void write_square(int id, int units_log2, uint word) {
    int first = plane(u_agreed + 1) + id;
    for (int i = 0; i < 1 << 2 * units_log2; i++) unit_word[first + unit_in(units_log2, i)] = word;
}

// Writes a quarter of a leaf that is split. Its spacing is at most the spacing of the whole leaf.
void write_part(int id, Leaf whole, int part_units_log2, ivec2 low, int ring, Projection p, bool is_new) {
    int side_log2 = whole.side_log2 - 1;
    bool is_on_map = all(lessThan(low, u_last_post)) && all(greaterThan(low + (1 << side_log2), ivec2(0)));
    int step_log2 = min(step_log2_of(whole.word), side_log2 - 1);
    if (!u_priced) step_log2 = next_step(low, side_log2, step_log2, finest_of(low, side_log2, ring, step_log2), p);
    if (step_log2 == NO_STEP) step_log2 = finest_of(low, side_log2, ring, side_log2 - 1);
    uint word = leaf_word(part_units_log2, step_log2);
    write_square(id, part_units_log2, is_on_map ? word : NOTHING);
    if (is_on_map && is_new) append_leaf(id);
    append_to_queue(id, word);
}

// The first unit of a leaf's parts; a leaf of a single unit becomes a block. -1: there is no room for another block.
int units_for_parts(Leaf leaf, Block b) {
    if (side_units_log2(leaf.word) > 0) return leaf.id;
    int child = int(atomicAdd(b_all.count, 1u));
    if (child >= u_most_blocks) return -1;  // the view is chosen again with more room
    b_block[child] = Block(leaf.origin, b.unit_log2 - 3, b.ring, NO_STEP);
    write_square(leaf.id, 0, IS_BLOCK | uint(child));
    append_to_queue(leaf.id, leaf.word);
    return UNITS * child;
}

void split(Leaf leaf, Block b) {
    bool in_block = side_units_log2(leaf.word) > 0;
    int part_units_log2 = in_block ? side_units_log2(leaf.word) - 1 : 2;
    int first = units_for_parts(leaf, b);
    if (first < 0) return;
    Projection p = project_square(leaf.origin, leaf.side_log2);
    for (int k = 0; k < 4; k++) {
        ivec2 at = ivec2(k & 1, k >> 1);
        int id = first + (at.y * 8 + at.x << part_units_log2);
        ivec2 low = leaf.origin + (at << leaf.side_log2 - 1);
        write_part(id, leaf, part_units_log2, low, b.ring, p, k > 0 || !in_block);
    }
}

// Put a leaf and all leaves along its edges into the next round's queue: its change may change their edges.
void queue_around(Leaf leaf) {
    append_to_queue(leaf.id, leaf.word);
    for (Walk walk = START; walk.side < 4;) {
        Leaf other = next_leaf(walk, leaf);
        if (is_leaf(other.word)) append_to_queue(other.id, other.word);
    }
}

// A unit that is not a leaf never changes again. The round before wrote it to one plane; copy it to the other.
void keep_units(int id, int units_log2) {
    for (int i = 0; i < 1 << 2 * units_log2; i++) {
        int at = id + unit_in(units_log2, i);
        uint word = unit_word[plane(u_agreed) + at];
        if (!is_leaf(word)) unit_word[plane(u_agreed + 1) + at] = word;
    }
}

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= b_queue[u_agreed & 7].count) return;
    uint entry = u_agreed == 0 ? listed[i].leaf : listed[i].in_queue[u_agreed & 1];
    int id = queued_id(entry);
    uint word = unit_word[plane(u_agreed) + id];
    if (!is_leaf(word)) {
        keep_units(id, queued_units_log2(entry));
        return;
    }
    Block b = b_block[id / UNITS];
    Leaf leaf = leaf_at(b, id, word);
    look_around_in(b.ring);
    ivec4 edges_log2 = edges_log2_of(leaf);
    bool can_split = side_units_log2(word) > 0 || b.unit_log2 >= 3;
    shape[id].x = shape_word(leaf.side_log2, step_log2_of(leaf.word), min(edges_log2, MOST_SEGMENTS_LOG2));
    if (can_split && any(greaterThan(edges_log2, ivec4(MOST_SEGMENTS_LOG2)))) {
        queue_around(leaf);
        split(leaf, b);
    } else if (word != unit_word[plane(u_agreed + 1) + id]) {
        write_square(id, side_units_log2(word), word);
    }
}
