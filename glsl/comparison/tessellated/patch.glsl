// comparison/tessellated/patch.glsl — the record of a cut patch, in whole numbers,
//   so that all stages and both sides of an edge agree. If the two neighbours at an edge are finer, the edge consists
//   of one edge of each neighbour, and has as many segments as both together. If an edge has more segments than posts,
//   it has a whole multiple of them, so that every post has a vertex.
// Provides Cut, cut_of(), words_of(), whole_parts(), inner_levels(), triangles_in().
//   Record: comparison.tessellated.CUT

struct Cut {
    ivec2 low, size;    // north-west post; posts from there to the south-east post
    ivec4 outer;        // segments of its edges: west, north, east, south
    ivec4 first_half;   // segments of the first half if an edge consists of two; or 0
};

uint bytes_of(ivec4 v) { return uint(v.x | v.y << 8 | v.z << 16 | v.w << 24); }

ivec4 of_bytes(uint word) { return ivec4(uvec4(word) >> uvec4(0, 8, 16, 24) & 255u); }

uvec4 words_of(Cut c) {
    return uvec4(c.low.x | c.low.y << 16, c.size.x | c.size.y << 16, bytes_of(c.outer), bytes_of(c.first_half));
}

Cut cut_of(uvec4 words) {
    return Cut(ivec2(words.x & 0xffffu, words.x >> 16), ivec2(words.y & 0xffffu, words.y >> 16), of_bytes(words.z),
               of_bytes(words.w));
}

int whole_parts(int segments, int posts, int most) {
    return segments <= posts ? segments : min((segments + posts - 1) / posts, most / posts) * posts;
}

// Inner levels: the means of the levels of opposite edges.
// If an edge has more than one segment, the tessellator rounds 1 up to 2.
ivec2 inner_levels(Cut c) {
    if (c.outer == ivec4(1)) return ivec2(1);
    ivec2 between = (c.outer.yx + c.outer.wz + 1) / 2;
    return max(ivec2(whole_parts(between.x, c.size.x, 64), whole_parts(between.y, c.size.y, 64)), ivec2(2));
}

// Triangles of the inner rectangle and of the strip along each edge.
// On posts alone, a strip at the map's rim may have no area.
int triangles_in(Cut c, bool on_posts) {
    if (c.outer == ivec4(0)) return 0;
    if (c.outer == ivec4(1)) return 2;
    ivec2 inside = inner_levels(c) - 2;
    ivec4 strip = c.outer + inside.yxyx;
    int flat_ = on_posts ? (c.size.x == 1 ? strip.z : 0) + (c.size.y == 1 ? strip.w : 0) : 0;
    return 2 * inside.x * inside.y + strip.x + strip.y + strip.z + strip.w - flat_;
}
