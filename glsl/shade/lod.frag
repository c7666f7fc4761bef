// shade/lod.frag — style "lod": the distance between vertices,
//   from violet (a post or less) over green to yellow (a sixteenth of the map or more). Borders of patches are dark.

#include "shade/drawn.glsl"

vec3 ground_colour(Ground g, int sample_) {
    Drawn d = drawn_at(sample_);
    int map_log2 = findMSB(max(u_last_post.x, u_last_post.y) - 1) + 1;  // a store's u_top_level may be lower
    vec3 tint = viridis(d.step_log2 / max(float(map_log2) - 4.0, 1.0));
    tint = mix(tint, vec3(1.0), 0.18);
    return tint * (0.40 + 0.75 * clay(g)) * (1.0 - 0.65 * d.border);
}

#define SKY_COLOUR vec3(0.93)
#include "shade/pixel.glsl"
