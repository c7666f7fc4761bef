// pages/terrain.glsl — a map of which only some tiles are on the GPU (docs/stores.md).
//   A page is a tile of PAGE × PAGE nodes of one level, with the posts at their corners. A loaded page is in a slot of
//   a pool, and all pages above it are loaded, too. The finest loaded page over a post gives its height: the post's
//   own height if it is on the lattice of that page, else the bilinear height between four posts of the lattice. So
//   all shaders see the same height. Page tables: for each level the slot of each page, + 1, and whether the page has
//   light; then, for each page of level 0, the finest loaded page over it.
// Provides height_m(), marks_at(), range_index(), loaded_level(), finest_over(), first_texel(), PAGE, slot_of(),
// lit_slot_of(), pages_of(), resident_level().

#ifndef WINDOW
#define PAGE (1 << PAGE_LOG2)
#define PAGE_ROW 1024  // words of a row of the tables' texture

layout(binding = 12) uniform usampler2D u_pages;

uint page_word(int i) { return texelFetch(u_pages, ivec2(i % PAGE_ROW, i / PAGE_ROW), 0).x; }

ivec2 pages_of(int level) { return (u_level[level].size + PAGE - 1) >> PAGE_LOG2; }

#define LIT 0x80000000u  // bit in a page's word: the page has light

uint word_of_page(int level, ivec2 page) {
    return page_word(u_level[level].first_page + page.y * pages_of(level).x + page.x);
}

// The slot of a page; -1 if the page is not loaded.
int slot_of(int level, ivec2 page) { return int(word_of_page(level, page) & ~LIT) - 1; }

// The slot of a page with light; -1 if the page is not loaded, or has no light yet.
int lit_slot_of(int level, ivec2 page) {
    uint word = word_of_page(level, page);
    return (word & LIT) != 0u ? int(word & ~LIT) - 1 : -1;
}

ivec2 first_texel(int slot) { return ivec2(slot % SLOTS_ACROSS, slot / SLOTS_ACROSS) * (PAGE + 1); }

float height_in_slot_m(int slot, ivec2 at) { return texelFetch(u_heights, first_texel(slot) + at, 0).x; }

// The finest loaded page over a page of level 0: its slot, and its level in the upper eight bits.
uint finest_over(ivec2 fine) { return page_word(u_level[0].first_node + fine.y * pages_of(0).x + fine.x); }

float height_m(ivec2 post) {
    ivec2 fine = min(post >> PAGE_LOG2, pages_of(0) - 1);
    uint word = finest_over(fine);
    int level = int(word >> 24), slot = int(word & 0xffffffu);
    ivec2 first = (fine >> level) << (PAGE_LOG2 + level), at = (post - first) >> level;
    ivec2 low = first + (at << level), high = min(low + (1 << level), u_last_post);
    // whether the post is in the map's last column, and last row: these are part of every lattice
    bvec2 is_high = bvec2(low.x < high.x && post.x == high.x, low.y < high.y && post.y == high.y);
    at += ivec2(is_high);
    if ((post.x == low.x || is_high.x) && (post.y == low.y || is_high.y)) return height_in_slot_m(slot, at);
    vec2 t = vec2(post - low) / vec2(max(high - low, ivec2(1)));
    if (is_high.x || post.x == low.x) t.x = 0.0;
    if (is_high.y || post.y == low.y) t.y = 0.0;
    ivec2 next = at + ivec2(t.x > 0.0, t.y > 0.0);
    float north = mix(height_in_slot_m(slot, at), height_in_slot_m(slot, ivec2(next.x, at.y)), t.x);
    float south = mix(height_in_slot_m(slot, ivec2(at.x, next.y)), height_in_slot_m(slot, next), t.x);
    return mix(north, south, t.y);
}

// The marks of a post. If its page of level 0 is not loaded: the marks of the post at or before it on the lattice of
// the finest loaded page. So a node of a coarser page is drawn as a hole only if all its cells are holes.
uint marks_at(ivec2 post) {
    ivec2 fine = min(post >> PAGE_LOG2, pages_of(0) - 1);
    uint word = finest_over(fine);
    int level = int(word >> 24), slot = int(word & 0xffffffu);
    ivec2 first = (fine >> level) << (PAGE_LOG2 + level);
    return texelFetch(u_marks, first_texel(slot) + (post - first >> level), 0).x;
}

// First and last page of a level that contain posts of a closed box.
ivec4 pages_over(ivec2 low, ivec2 end, int level) {
    ivec2 most = pages_of(level) - 1;
    int side_log2 = PAGE_LOG2 + level;
    return ivec4(min(max(low, ivec2(0)) >> side_log2, most), min(min(end, u_last_post) >> side_log2, most));
}

// The finest level, from `level` up, whose pages over a closed box are all loaded. `is_mixed`: the box lies over
// several pages of that level, or parts of the box have finer pages.
int resident_level(ivec2 low, ivec2 end, int level, out bool is_mixed) {
    is_mixed = false;
    for (; level < u_top_level; level++) {
        ivec4 pages = pages_over(low, end, level);
        bool all_there = true;
        for (int y = pages.y; y <= pages.w; y++)
            for (int x = pages.x; x <= pages.z; x++) {
                bool is_there = slot_of(level, ivec2(x, y)) >= 0;
                all_there = all_there && is_there;
                is_mixed = is_mixed || is_there;
            }
        if (all_there) break;
    }
    ivec4 pages = pages_over(low, end, level);
    is_mixed = is_mixed || any(notEqual(pages.xy, pages.zw));
    return level;
}

// The finest level, from a given one on, at which a whole box is loaded.
int loaded_level(ivec2 low, ivec2 end, int from) {
    bool is_mixed;
    return resident_level(low, end, from, is_mixed);
}

// The index of a node's range. If its page is not loaded: the index of the nearest node above whose page is loaded.
int range_index(int level, ivec2 at) {
    int slot = slot_of(level, at >> PAGE_LOG2);
    while (slot < 0) {
        at >>= 1;
        slot = slot_of(++level, at >> PAGE_LOG2);
    }
    ivec2 in_page = at & PAGE - 1;
    return (slot * PAGE + in_page.y) * PAGE + in_page.x;
}
#endif
