// pages/bound.glsl — error/bound.glsl for a map of which only some pages are on the GPU (pages/terrain.glsl).
//   Each page has its own tables. If all pages over a box and its border are loaded at the level j of the spacing, the
//   bound is the bound of the whole map's tables. Elsewhere the heights are bilinear between the posts of a coarser
//   page, of level l > j. Let M be the largest error of a page's cells:
//     - Inside one page. Bilinear heights lie between both diagonals of the page's cells, and so does every mesh
//       through these heights. So the error of the mesh is at most M, however fine its triangles are.
//     - Across pages. A cell of the mesh in page A may have corners in page B. With A's heights there, the cell's error
//       would be at most M_A; A's heights differ from B's by at most M_A + M_B. So the error is at most
//       2 M_A + M_B ≤ 3 max M.
//       Records say nothing of holes: a node with a hole has no such bound until all pages over the box are loaded.
//   The proof: docs/stores.md.
// Provides none_above_over(), largest_of_coarse_m(), has_holes().
// Python twins: reference.bound_max_m, reference.class_tables

#define PAGE_WORDS ((CLASSES / 4) * (PAGE >> COUNT_TILE_LOG2) * (PAGE >> COUNT_TILE_LOG2))

Table counts_of_page(int slot, int level) { return Table(uint(slot * PAGE_WORDS), ivec2(PAGE >> tile_log2(level))); }

// First and last node of a level that a box of posts meets.
ivec4 nodes_over(ivec2 low, ivec2 end, int level) {
    return ivec4(max(low, ivec2(0)) >> level, (min(end, u_last_post) - 1) >> level);
}

ivec4 tiles_in_page(ivec4 nodes, ivec2 page, int level) {
    ivec2 origin = page << PAGE_LOG2;
    ivec2 first = max(nodes.xy - origin, ivec2(0));
    ivec2 last = min(nodes.zw - origin, ivec2(PAGE - 1));
    return ivec4(first >> tile_log2(level), (last >> tile_log2(level)) + 1);
}

// Whether no error of a level over a rectangle of posts is above a class, in the pages that are loaded.
bool none_above_over(ivec2 low, ivec2 end, int level, int c) {
    ivec4 nodes = nodes_over(low, end, level);
    for (int y = nodes.y >> PAGE_LOG2; y <= nodes.w >> PAGE_LOG2; y++)
        for (int x = nodes.x >> PAGE_LOG2; x <= nodes.z >> PAGE_LOG2; x++) {
            int slot = slot_of(level, ivec2(x, y));
            if (slot < 0) continue;
            if (!none_above(counts_of_page(slot, level), tiles_in_page(nodes, ivec2(x, y), level), c)) return false;
        }
    return true;
}

// Whether a node of the box has a hole. All pages of this level over the box must be loaded.
bool has_holes(ivec2 low, ivec2 end, int level) {
#ifndef NO_VOIDS
    if (u_has_voids == 0) return false;
    ivec4 nodes = nodes_over(low, end, level);
    for (int y = nodes.y; y <= nodes.w; y++)
        for (int x = nodes.x; x <= nodes.z; x++) {
            ivec2 texel = first_texel(slot_of(level, ivec2(x, y) >> PAGE_LOG2)) + (ivec2(x, y) & PAGE - 1);
            if ((texelFetch(u_marks, texel, 0).x & uint(HOLED)) != 0u) return true;
        }
#endif
    return false;
}

// The bound for a box if some of its pages of level `from` are not loaded; `level` is the finest level at which all
// pages over the box are loaded.
float largest_of_coarse_m(ivec2 low, ivec2 end, int from, int level, bool is_mixed) {
    float worst_m = largest_of_level_m(low, end, level);
    if (!is_mixed) return worst_m;
    if (has_holes(low, end, level)) return most_m();
    for (int finer = from; finer < level; finer++) worst_m = max(worst_m, largest_of_level_m(low, end, finer));
    return min(3.0 * worst_m, most_m());
}
