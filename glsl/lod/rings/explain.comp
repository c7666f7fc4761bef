// lod/rings/explain.comp — what the tables say about a patch of the clipmap: its error with T = 1, 2, 4, ... 64
//   segments a side, and the look-up that decides whether T is enough: how many tiles of the patch are above the
//   largest class of errors that is within the tolerance there (error/bound.glsl). Squares of 2 × 2 cells or fewer have
//   no look-up: the cells themselves are read. One thread for each T.

#include "lod/rings/mean.glsl"

layout(local_size_x = SIZES) in;

struct Lookup {
    ivec4 tiles;    // first column, first row; then the column and the row after the last
    uvec4 corner;   // entries at the box's corners, modulo 256: north-west, north-east, south-west, south-east
    int class_;     // NO_CLASS: no look-up
    int level;      // of the table
    int above;      // tiles above the class
    float limit_m;  // the class's limit
};

layout(std430, binding = 4) writeonly buffer Answer {
    vec4 projection;     // least depth in metres, stretch, whether wholly in the picture, whether wholly outside
    vec4 range_m;        // lowest and highest height
    // largest error in metres, RMS error in metres, bound in pixels, 1; all 0 without tables for the spacing
    vec4 choice[SIZES];
    Lookup lookup[SIZES];
};

uniform ivec2 u_low;      // post of the patch's north-west corner
uniform int u_side_log2;  // log2 of its side in posts

#ifdef PAGED
Lookup lookup_of(Projection p, int step_log2) { return Lookup(ivec4(0), uvec4(0), NO_CLASS, 0, 0, 0.0); }
#else
Lookup lookup_of(Projection p, int step_log2) {
    Lookup l = Lookup(ivec4(0), uvec4(0), NO_CLASS, max(step_log2, 0), 0, 0.0);
    float smaller = step_log2 < 0 ? exp2(2.0 * float(step_log2)) : 1.0;  // error of a part of a cell / that of the cell
    float allowed_m = (error_within_m(p, u_tolerance_px) - slack_m(step_log2)) / smaller;
    if (allowed_m <= 0.0 || p.outside || (step_log2 <= 0 && u_side_log2 <= FEW_LOG2)) return l;
    l.class_ = max(class_within(allowed_m), NO_CLASS);
    if (l.class_ == NO_CLASS) return l;
    l.limit_m = class_limit_m(l.class_) * smaller;
    Table counts;
    l.tiles = tiles_over(u_low, u_low + (1 << u_side_log2), l.level, counts);
    int layer = l.class_ >> 2, bit = 8 * (l.class_ & 3);
    for (int i = 0; i < 4; i++) {
        ivec2 at = ivec2(l.tiles[2 * (i & 1)], l.tiles[1 + 2 * (i >> 1)]);
        l.corner[i] = SAT(uint, COUNTER, counts, layer, at.x, at.y) >> bit & 255u;
    }
    for (ivec2 at = l.tiles.xy; at.y < l.tiles.w; at = next_part(at, l.tiles))
        l.above += int(count_sum(counts, layer, at, min(at + 15, l.tiles.zw)) >> bit & 255u);
    return l;
}
#endif

void main() {
    int k = int(gl_LocalInvocationIndex), step_log2 = u_side_log2 - k;
    Projection p = project_square(u_low, u_side_log2);
    if (k == 0) {
        projection = vec4(p.nearest_m, p.stretch, p.inside, p.outside);
        range_m = vec4(range_of_square_m(u_low, u_side_log2), 0.0, 0.0);
    }
    bool is_known = step_log2 <= coarsest_step(u_low, u_side_log2) && step_log2 >= FINEST;
    choice[k] = vec4(0.0);
    if (!is_known) return;
    lookup[k] = lookup_of(p, step_log2);
    p.sag_m = slack_m(step_log2);
    vec2 errors_m = cells_m(u_low, u_side_log2, step_log2, few_cells_m(u_low, u_side_log2));
    float rms_m = min(errors_m.y, errors_m.x);
    bool has_mean_px = u_metric == METRIC_RMS && has_mean(p, u_low, u_side_log2, step_log2);
    float px = error_px(p, has_mean_px ? rms_m : errors_m.x, errors_m.x);
    choice[k] = vec4(vec2(errors_m.x, rms_m) + p.sag_m, p.outside ? 0.0 : px, 1.0);
}
