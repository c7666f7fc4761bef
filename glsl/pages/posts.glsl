// pages/posts.glsl — shade/posts.glsl for a map of which only some pages are on the GPU (pages/terrain.glsl).
//   Each page has the summed-area table of its own posts.
//   A post on the border of two pages belongs to the second page; the last pages have one row or column more.
//   So the sums of the parts of a box add up to the sum of the box, exactly modulo 2^32.
// Provides the functions of shade/posts.glsl.   Python twins: reference.sat, terrain.steps_of

struct Part {
    int level;
    ivec4 pages;   // first and last page over the box
    ivec2 page;
    ivec2 first;   // first post of the page
    ivec2 count;   // columns and rows of posts that belong to the page
    int first_word;
};

ivec2 last_of(int level) { return u_level[level].size; }

ivec2 page_at(int level, ivec2 at) { return min(at >> PAGE_LOG2, pages_of(level) - 1); }

ivec2 texel_of(int level, ivec2 page) { return first_texel(max(slot_of(level, page), 0)); }

void enter_page(inout Part part, ivec2 page) {
    part.page = page;
    part.first = page << PAGE_LOG2;
    ivec2 left = last_of(part.level) + 1 - part.first;
    part.count = ivec2(left.x > PAGE + 1 ? PAGE : left.x, left.y > PAGE + 1 ? PAGE : left.y);
    part.first_word = max(slot_of(part.level, page), 0) * (PAGE + 1) * (PAGE + 1);
}

Part first_part(int level, ivec2 low, ivec2 end) {
    Part part;
    part.level = level;
    part.pages = ivec4(page_at(level, low), page_at(level, max(end - 1, low)));
    enter_page(part, part.pages.xy);
    return part;
}

bool next_part(inout Part part) {
    ivec2 next = part.page.x < part.pages.z ? part.page + ivec2(1, 0) : ivec2(part.pages.x, part.page.y + 1);
    if (next.y > part.pages.w) return false;
    enter_page(part, next);
    return true;
}

// Sum of heights over the posts that belong to the page and lie before column x and before row y of the lattice.
uint sum_in(Part part, int x, int y) {
    ivec2 at = clamp(ivec2(x, y) - part.first, ivec2(0), part.count) - 1;
    // A mask is faster than a branch.
    return HEIGHT_SUM(part.first_word + max(at.y, 0) * (PAGE + 1) + max(at.x, 0)) & ~uint((at.x | at.y) >> 31);
}

// Heights of 4 × 4 posts, as in shade/posts.glsl. They lie in at most 2 × 2 pages.
mat4 heights_from(int level, ivec2 first) {
    ivec2 last = last_of(level);
    ivec2 low = page_at(level, clamp(first, ivec2(0), last));
    ivec2 high = page_at(level, clamp(first + 3, ivec2(0), last));
    ivec2 page[4] = ivec2[4](low, ivec2(high.x, low.y), ivec2(low.x, high.y), high);
    ivec2 corner[4];  // first texel of each page minus its first post
    for (int i = 0; i < 4; i++) corner[i] = texel_of(level, page[i]) - (page[i] << PAGE_LOG2);
    mat4 h;
    for (int y = 0; y < 4; y++)
        for (int x = 0; x < 4; x++) {
            ivec2 at = clamp(first + ivec2(x, y), ivec2(0), last);
            bvec2 second = greaterThan(page_at(level, at), low);
            ivec2 north = second.x ? corner[1] : corner[0], south = second.x ? corner[3] : corner[2];
            h[y][x] = texelFetch(u_heights, at + (second.y ? south : north), 0).x;
        }
    return h;
}
