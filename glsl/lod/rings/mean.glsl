// lod/rings/mean.glsl — the mean over the picture. Patch p has n cells, and its own root mean square is at most b px.
//   mean² ≤ Σ n b² / Σ' n      Σ over all drawn patches, Σ' over those wholly in the picture and without voids
//   docs/guarantee.md, section 4
// Provides has_mean(), cells_m().   Python twin: reference.rings.mean_px

#include "lod/rings/leaf.glsl"
#include "error/certified.glsl"

#ifndef PAGED  // else pages/bound.glsl has it, and reads a level's nodes
bool has_holes(ivec2 low, ivec2 end, int level) {
#ifndef NO_VOIDS
    ivec2 first = max(low, ivec2(0)), posts = min(end, u_last_post) - first + 1;
    for (int i = 0; i < posts.x * posts.y; i++)
        if (is_void(first + ivec2(i % posts.x, i / posts.x))) return true;
#endif
    return false;
}
#endif

// Whether all of a square is in the picture, and has data. A mean over a square certifies nothing about a part of it.
bool has_mean(Projection p, ivec2 low, int side_log2, int step_log2) {
    ivec2 end = low + (1 << side_log2);
    return p.inside && !has_holes(low, end, loaded_level(low, end, max(step_log2, 0)));
}

// Largest error and root mean square of a square's cells: from the tables, or from the cells themselves if they are
// few. For spacings below that of the posts, each cell of the map is cut into parts.
vec2 cells_m(ivec2 low, int side_log2, int step_log2, vec2 exact_m) {
    if (step_log2 <= 0 && exact_m.x < HUGE) return exact_m * exp2(2.0 * float(step_log2));
    ivec2 end = low + (1 << side_log2);
    vec2 cells = vec2(min(end, u_last_post) - max(low, ivec2(0)));
    float rms_m = sqrt(squares_m2(low, end, step_log2) / (cells.x * cells.y)) * (1.0 + exp2(-18.0));
    return vec2(largest_m(low, end, step_log2), rms_m);
}
