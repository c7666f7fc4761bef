// lod/rings/compare.comp — the mesh of a budget, compared with the mesh of every post, which has two triangles in each cell of the map.
//   The squared errors in pixels are summed over PLACES × PLACES places of each cell, as verify/measure.py does. The driver chooses some
//   diagonals: there the mean of both is taken. In a cell of twist t, two triangles differ from the truth at (x, y) by
//       t (min(x, y) - x y)   or   t (max(x + y - 1, 0) - x y).
//   One work group handles one block of a ring of the map's own cells, one thread a cell.

#include "mesh/between.glsl"
#include "lod/rings/leaf.glsl"
#include "lod/rings/shapes.glsl"

layout(local_size_x = UNITS) in;
// for each block: the sum of this mesh, that of every post, and the triangles of every post
layout(std430, binding = 5) writeonly buffer Compared { vec4 compared[]; };

shared vec3 s_cell[UNITS];

// The quad or the fan that covers a cell. Two triangles with a cut edge become a fan.
struct Cover {
    Node n;
    bool is_fan;
    ivec4 edges_log2;
};

Cover cover_of(ivec2 cell, Leaf leaf, int step_log2) {
    int side_log2 = side_log2_of(leaf), segments_log2 = side_log2 - step_log2;
    ivec4 edges_log2 = edges_log2_in(shape[leaf.id].x);
    bool is_node = side_log2 >= 1 && coarsest_step(leaf.origin, side_log2) == side_log2;
    bool is_fan = is_node && (segments_log2 == 1 || (segments_log2 == 0 && edges_log2 != ivec4(0)));
    int level = is_fan ? side_log2 : max(step_log2, 1);
    return Cover(node_at(level, cell >> level), is_fan, edges_log2);
}

float squared_m2(Cover cover, vec2 place, float h_m) {
    int wedge;
    vec2 weights, errors_m = quad_errors_m(cover.n, place, h_m);
    if (cover.is_fan) {
        errors_m = fan_errors_m(cover.n, place, h_m, wedge, weights);
        errors_m = vec2(cover.edges_log2[wedge] > 0 ? errors_m.y : errors_m.x);
    }
    return 0.5 * dot(errors_m, errors_m);
}

// Squared pixels of a metre of error at a place; 0 outside the picture.
float squared_px_per_m(vec2 from_eye_m, float h_m) {
    vec3 q = to_camera(vec3(from_eye_m, up_from_eye_m(h_m) - drop_m(from_eye_m)));
    if (q.z < near_m() || any(greaterThan(abs(q.xy), u_half_extent * q.z))) return 0.0;
    vec2 px = u_focal_px / q.z * (vec2(u_right.z, u_up.z) - q.xy / q.z * u_forward.z);
    return dot(px, px);
}

// Sums over a cell: of this mesh, and of every post.
vec2 squares_px2(ivec2 cell, Leaf leaf) {
    int step_log2 = step_log2_of(leaf.word);
    Cover cover = cover_of(cell, leaf, step_log2);
    ivec2 places = PLACES + ivec2(equal(cell + 1, u_last_post));  // the last cells have both ends
    float t = twist_m(cell);
    vec2 sum = vec2(0.0);
    for (int k = 0; k < places.x * places.y; k++) {
        vec2 at = vec2(k % places.x, k / places.x) / float(PLACES);
        float h_m = bilinear_m(cell, at);
        vec2 bends_m = t * (vec2(min(at.x, at.y), max(at.x + at.y - 1.0, 0.0)) - at.x * at.y);
        float every_m2 = 0.5 * dot(bends_m, bends_m), ours_m2 = every_m2 * exp2(4.0 * float(step_log2));
        if (step_log2 > 0) ours_m2 = squared_m2(cover, vec2(cell - cover.n.low) + at, h_m - cover.n.base_m);
        sum += squared_px_per_m(post_from_eye_m(cell) + at * vec2(u_spacing_m.x, -u_spacing_m.y), h_m) * vec2(ours_m2, every_m2);
    }
    return sum / float(PLACES * PLACES);
}

void main() {
    int unit = int(gl_LocalInvocationIndex), b = int(gl_WorkGroupID.x);
    ivec2 cell = b_block[b].origin + unit_at(unit);
    look_around_in(0);
    Leaf leaf = leaf_over(cell);
    bool is_drawn = is_leaf(leaf.word) && is_within(cell, ivec2(0), u_last_post);
    bool is_seen = is_drawn && (u_cull == 0 || !project_square(cell, 0).outside);
    s_cell[unit] = vec3(is_drawn && !is_hole(cell) ? squares_px2(cell, leaf) : vec2(0.0), is_seen ? 2.0 : 0.0);
    barrier();
    if (unit > 0) return;
    vec3 sum = vec3(0.0);
    for (int k = 0; k < UNITS; k++) sum += s_cell[k];
    compared[b] = vec4(sum, 0.0);
}
