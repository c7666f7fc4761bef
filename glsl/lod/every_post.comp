// lod/every_post.comp — cells at full resolution, for the methods "full" and "truth": how many cells of each square are
//   in the picture, and the largest of their bounds. A cell is drawn as two triangles, whose error is at most a quarter
//   of the cell's twist: docs/guarantee.md, section 1. One thread handles one square.
// Python twins: reference.diagonal_error, reference.project_boxes

#include "error/bound.glsl"
#include "lod/project.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 4) readonly buffer Corners { ivec2 corner[]; };  // north-west posts of squares
layout(std430, binding = 5) writeonly buffer Found { vec2 found[]; };     // cells in the picture, largest bound in px

uniform int u_squares;
uniform int u_side_log2;

// Cells have no range of heights. The range of the node around them contains theirs.
Projection project_cells(ivec2 low, int side_log2) {
    int level = clamp(side_log2, 1, u_top_level);
    vec2 range_m = unpack_range(range[node_index(level, low >> level)]);
    return project(box_of(low, min(low + (1 << side_log2), u_last_post), range_m), 1.0);
}

void main() {
    int i = int(gl_GlobalInvocationID.x), side = 1 << u_side_log2;
    if (i >= u_squares) return;
    found[i] = vec2(0.0);
    if (u_cull != 0 && project_cells(corner[i], u_side_log2).outside) return;
    int cells = 0;
    float worst_px = 0.0;
    for (int k = 0; k < side * side; k++) {
        ivec2 cell = corner[i] + ivec2(k & side - 1, k >> u_side_log2);
        if (any(greaterThanEqual(cell, u_last_post))) continue;
        Projection p = project_cells(cell, 0);
        if (u_cull != 0 && p.outside) continue;
        cells++;
        if (p.outside || is_hole(cell)) continue;
        p.sag_m = rounding_between_m();
        float error_m = 0.25 * abs(twist_m(cell)) * (1.0 + exp2(-20.0));
        worst_px = max(worst_px, error_px(p, error_m, error_m));
    }
    found[i] = vec2(cells, worst_px);
}
