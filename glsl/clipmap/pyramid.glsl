// clipmap/pyramid.glsl — heights at every level of detail: level 0 is the map, each further level is the level below,
// filtered and halved (clipmap/halve.comp).
//   Sample i of level j is at post min(i · 2^j, last). So the last sample is on the rim for maps of any size.
//   Level 1 is the left part of the texture; all others are in a column to its right.
// Provides sample_m(), last_sample(), post_of_sample().   Python twin: comparison.pyramid.Pyramid

#include "blocks/terrain.glsl"

layout(binding = 5) uniform sampler2D u_pyramid;

layout(std140, binding = 3) uniform Pyramid {
    ivec4 u_first_texel[MAX_LEVELS];  // column and row of a level's first sample
};

ivec2 last_sample(int level) { return u_level[level].size; }

ivec2 post_of_sample(int level, ivec2 i) { return min(i << level, u_last_post); }

float sample_m(int level, ivec2 i) {
    return level == 0 ? height_m(i) : texelFetch(u_pyramid, u_first_texel[level].xy + i, 0).x;
}
