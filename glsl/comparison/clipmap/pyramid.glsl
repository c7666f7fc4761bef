// comparison/clipmap/pyramid.glsl — heights at every level of detail:
//   level 0 is the map, each further level is the level below, filtered and halved (comparison/clipmap/halve.comp).
//   Sample i of level j is at post min(i · 2^j, last). So the last sample is on the rim for maps of any size.
//   Level −k cuts each cell of the map into 2^k × 2^k parts:
//   sample i is i / 2^k posts from the first, bilinear between posts. Level 1 is the left part of the texture; levels 2
//   and up are in a column to its right. Levels 0 and below are read from the map.
// Provides sample_m(), last_sample(), place_of_sample().   Python twin: comparison.pyramid.Pyramid

#include "mesh/between.glsl"

layout(binding = 5) uniform sampler2D u_pyramid;

layout(std140, binding = 3) uniform Pyramid {
    ivec4 u_first_texel[MAX_LEVELS];  // column and row of a level's first sample
};

ivec2 last_sample(int level) { return level < 0 ? u_last_post << -level : u_level[level].size; }

// Place of a sample, in 64ths of a post.
ivec2 place_of_sample(int level, ivec2 i) { return min(i << level + 6, u_last_post << 6); }

float sample_m(int level, ivec2 i) {
    if (level < 0) return bilinear_m(i >> -level, vec2(i & (1 << -level) - 1) / float(1 << -level));
    return level == 0 ? height_m(i) : texelFetch(u_pyramid, u_first_texel[level].xy + i, 0).x;
}
