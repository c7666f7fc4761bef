// tessellated/patch.glsl — how finely a patch is cut, in whole numbers: so that all stages, and both sides of an edge, agree.
//   An edge with a finer neighbour is two of its edges, one after the other: it has as many segments as both together.
// Provides Cut, cut_of(), words_of(), inner_levels(), triangles_in().   Record: comparison.tessellated.CUT

struct Cut {
    ivec2 low, size;    // north-west post; posts to the south-east one
    ivec4 outer;        // segments of its edges: west, north, east, south
    ivec4 first_half;   // those of an edge's first half, where it is two; or 0
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

// Between those of opposite edges. One segment inside, with more on any edge, is two to the tessellator.
ivec2 inner_levels(ivec4 outer) {
    if (outer == ivec4(1)) return ivec2(1);
    return max((outer.yx + outer.wz + 1) / 2, ivec2(2));
}

// A rectangle inside, and around it a strip along each edge; a strip on the map's rim has no area where the patch is a post wide.
int triangles_in(Cut c) {
    if (c.outer == ivec4(0)) return 0;
    if (c.outer == ivec4(1)) return 2;
    ivec2 inside = inner_levels(c.outer) - 2;
    ivec4 strip = c.outer + inside.yxyx;
    int flat_ = (c.size.x == 1 ? strip.z : 0) + (c.size.y == 1 ? strip.w : 0);
    return 2 * inside.x * inside.y + strip.x + strip.y + strip.z + strip.w - flat_;
}
