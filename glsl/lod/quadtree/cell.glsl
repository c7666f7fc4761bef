// lod/quadtree/cell.glsl — the error inside a cell of the map. The truth is bilinear; its corners have the twist
//   t = a − b − c + d. Two triangles have an error of at most |t|/4, four around the centre |t|/16.
//   With n × n parts, n ≥ 4, whose outer edges stay whole, a triangle at an edge covers at most 1 × 1/n of the cell,
//   and its error is at most |t| (1 − 1/n) / (4 n).
//   (Truth minus triangle is t u v minus a plane. This is harmonic, so it is largest on an edge of the triangle. On an
//   edge (dx, dy), in parts of the cell, it is at most |t dx dy| / 4.)
// Provides cell_error_m(), cell_segments_log2().   Python twin: reference.cell_error

#include "error/node_errors.glsl"
#include "lod/project.glsl"

#define MOST_CELL_SEGMENTS_LOG2 6

float cell_error_m(float twist_m_, int segments_log2) {
    float per_n = exp2(-float(segments_log2));
    float share = segments_log2 < 2 ? per_n * per_n : (1.0 - per_n) * per_n;
    return 0.25 * abs(twist_m_) * share * (1.0 + exp2(-20.0));
}

float cell_px(Projection p, float twist_m_, int segments_log2) {
    float error_m = cell_error_m(twist_m_, segments_log2);
    return metric_px(p, error_m, error_m);
}

// The smallest number of segments within the tolerance.
int cell_segments_log2(Projection p, ivec2 cell) {
    if (p.outside || is_hole(cell)) return 0;
    float t_m = twist_m(cell);
    int segments_log2 = 0;
    while (segments_log2 < MOST_CELL_SEGMENTS_LOG2 && cell_px(p, t_m, segments_log2) > u_tolerance_px) segments_log2++;
    return segments_log2;
}

// Triangles of a cell whose edges are whole.
uint cell_triangles(int segments_log2) {
    uint n = 1u << segments_log2;
    return segments_log2 == 0 ? 2u : 2u * (n - 2u) * (n - 2u) + 4u * (n - 1u);
}
