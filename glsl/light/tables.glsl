// light/tables.glsl — means over boxes in the three summed-area tables of light. Words wrap, so sums are exact.
//   MERGED  the ground's lobes: light/lobes.glsl       SKY_SHARES  visible shares of the sky's lobes: horizon/fold.comp
//   SUNLIT  sunlight: horizon/sunlit.comp
//   Sums are bilinear between texels, so a mean is continuous in its box.
// Provides box_between(), table_mean().   Python twin: reference.box_mean

#define MERGED 0
#define SKY_SHARES 1
#define SUNLIT 2

#ifdef WORDS_IN_TEXTURES  // see shade/posts.glsl
layout(binding = 13) uniform usamplerBuffer u_lobe_sums;
layout(binding = 14) uniform usamplerBuffer u_shares;
layout(binding = 15) uniform usamplerBuffer u_sunlit;
#define WORD(name, block, i) texelFetch(name, i).x
#else
layout(std430, binding = 3) readonly buffer Lobes { uint lobe_sum[]; };
layout(std430, binding = 4) readonly buffer Shares { uint share[]; };
layout(std430, binding = 5) readonly buffer Sunlit { uint sunlit[]; };
#define WORD(name, block, i) block[i]
#endif

struct TexelBox {
    ivec2 size;
    // x: the two columns beside the west side, then the two beside the east side; negative if outside the table.
    // row: the same for the rows beside the north and south sides, times the table's width.
    ivec4 x, row;
    vec4 part;     // fraction of a texel that a side is beyond its first word: west, north, east, south
    float area;
};

// The box from a to c, in texels of a table.
TexelBox box_between(vec2 a, vec2 c, ivec2 size) {
    ivec4 next = ivec4(0, 1, 0, 1);  // added to whole numbers: a + 1.0 may round up to one more
    ivec4 x = min(ivec4(a.xx, c.xx) + next, size.x) - 1, y = min(ivec4(a.yy, c.yy) + next, size.y) - 1;
    return TexelBox(size, x, y * size.x, fract(vec4(a, c)), (c.x - a.x) * (c.y - a.y));
}

// The sum up to a word; 0 beyond the rim. A mask is faster than a branch.
int sum_to(int table, int layer_start, int x, int row) {
    int i = layer_start + max(row, 0) + max(x, 0), outside = (x | row) >> 31;
    if (table == MERGED) return int(WORD(u_lobe_sums, lobe_sum, i)) & ~outside;
    if (table == SUNLIT) return int(WORD(u_sunlit, sunlit, i)) & ~outside;
    return int(WORD(u_shares, share, i)) & ~outside;
}

// Differences of wrapped sums are exact as integers; convert them to float afterwards.
float table_mean(int table, int layer, TexelBox b) {
    int start = layer * b.size.x * b.size.y;
    ivec3 first;
    vec4 rows;
    for (int j = 0; j < 4; j++) {
        int west = sum_to(table, start, b.x[0], b.row[j]);
        ivec3 sums = ivec3(sum_to(table, start, b.x[1], b.row[j]), sum_to(table, start, b.x[2], b.row[j]),
            sum_to(table, start, b.x[3], b.row[j])) - west;
        if (j == 0) first = sums;
        vec3 s = vec3(sums - first);
        rows[j] = mix(s.y, s.z, b.part.z) - s.x * b.part.x;
    }
    return (mix(rows.z, rows.w, b.part.w) - rows.y * b.part.y) / b.area;
}
