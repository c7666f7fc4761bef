// shade/posts.glsl — what shade/relief.glsl reads: the heights of a lattice of posts, and sums of them over boxes.
//   A map in memory has one lattice, that of level 0, and one summed-area table. In a store, each level has a lattice,
//   and each page has a table of its own (pages/posts.glsl). So a box lies in one part or in several. The loop
//     Part part = first_part(level, low, end);
//     do sum += sum_in(part, x, y); while (next_part(part));
//   gives S(x, y) of a table of the whole lattice, minus a number that is the same for all corners of the box.
// Provides last_of(), heights_from(), Part, first_part(), next_part(), sum_in().   Python twin: reference.sat

#include "blocks/terrain.glsl"

// A storage block, or the same buffer as a texture:
// software renderers read a texture in a third of the time, but a texture may hold fewer words.
#ifdef WORDS_IN_TEXTURES
layout(binding = 10) uniform usamplerBuffer u_height_sums;
#define HEIGHT_SUM(i) texelFetch(u_height_sums, i).x
#else
layout(std430, binding = 0) readonly buffer HeightSums { uint height_sum[]; };
#define HEIGHT_SUM(i) height_sum[i]
#endif

#ifndef PAGED
struct Part { int level; };

ivec2 last_of(int level) { return u_last_post; }

Part first_part(int level, ivec2 low, ivec2 end) { return Part(level); }

bool next_part(inout Part part) { return false; }

// Sum over the posts before column x and row y.
uint sum_in(Part part, int x, int y) {
    if (x == 0 || y == 0) return 0u;
    return HEIGHT_SUM((y - 1) * (u_last_post.x + 1) + x - 1);
}

// Heights of 4 × 4 posts: rows from `first` on, each from west to east. Outside the map the rim is repeated.
mat4 heights_from(int level, ivec2 first) {
    mat4 h;
    vec2 texel = 1.0 / vec2(u_last_post + 1);
    for (int k = 0; k < 4; k++) {
        ivec2 at = 2 * ivec2(k & 1, k >> 1);
        vec4 four = textureGather(u_heights, vec2(first + at + 1) * texel);  // counter-clockwise from the south-west
        h[at.y][at.x] = four.w;
        h[at.y][at.x + 1] = four.z;
        h[at.y + 1][at.x] = four.x;
        h[at.y + 1][at.x + 1] = four.y;
    }
    return h;
}
#else
#include "pages/posts.glsl"
#endif
