// horizon/blocks.glsl — the size and the units of the table of sunlight (horizon/sunlit.comp).
// Provides sun_blocks().

#include "blocks/terrain.glsl"

#define SUN_LAYERS 5
#define SUN_STEPS 8191.0  // 14 bits with the sign: sums of 2^18 blocks are exact, boxes of 1024 × 1024 posts
#define STEEPEST 4.0      // the slope that the table stores as 1

ivec2 sun_blocks() { return (u_last_post + 1) / 2; }
