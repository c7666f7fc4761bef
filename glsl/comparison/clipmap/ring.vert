// comparison/clipmap/ring.vert — a vertex of a ring:
//   Asirvatham and Hoppe 2005, "Terrain Rendering Using GPU-Based Geometry Clipmaps", GPU Gems 2, chapter 2.
//   z = (1 − α) z_fine + α z_coarse
//   α = max(α_x, α_y),   α_x = clamp((|x − eye_x| − (reach − w − 1)) / w, 0, 1)
// where z_coarse is the height of the coarser level's surface at this place.
// On the ring's border α = 1, and each odd vertex is moved to its even neighbour.
// So fine and coarse edges are equal, and there is no T-junction:
//      │ ╱│ ╱│ ╱│ ╱│        │ ╱│ ╱│ ╱│ ╱│
//      ┼──┼──┼──┼──┼   →    ┼──┼──┼──┼──┼
//      │ ╱│ ╱│ ╱│ ╱│        │ ╱   ╲│ ╱   ╲      (two of eight triangles are gone)
//      ┴──┴──┴──┴──┴        ┴──────┴──────
//      └─ coarse ──┘        └─ coarse ──┘
// Python twin of the block: comparison.clipmap.CLIPMAP

#include "comparison/clipmap/pyramid.glsl"
#include "mesh/vertex.glsl"

#ifndef BLOCK
#define BLOCK 8
#endif

// the record of a block
in ivec4 in_cells;   // north-west vertex on its level's lattice; columns and rows of cells, at most BLOCK
in ivec4 in_border;  // lattice lines where the ring meets the coarser one: west, north, east, south; −1 for none
in int in_level;

layout(std140, binding = 4) uniform Clipmap {
    vec2 u_reach;        // cells from the eye to the ring's border, in columns and rows
    vec2 u_transition;   // w, cells
    ivec2 u_middle;      // the post at the centre of the rings
    vec2 u_middle_m;     // offset from this post to the eye: metres east, north
    int u_coarsest;      // level
};

// Odd places of a border move to the even place before them, which the coarser level also has. The map's rim stays.
ivec2 on_coarse_edge(ivec2 at, bvec2 along, ivec2 rim) {
    bvec2 odd = notEqual(at & 1, ivec2(0));
    if (along.x && odd.x && at.x != rim.x) at.x--;
    if (along.y && odd.y && at.y != rim.y) at.y--;
    return at;
}

// The coarser surface at this place: interpolated between two of its vertices, along an edge or the diagonal.
float coarser_m(int level, ivec2 at) {
    ivec2 rim = last_sample(level), high = at + 1 >> 1, low = at >> 1;
    low = ivec2(at.x == rim.x ? high.x : low.x, at.y == rim.y ? high.y : low.y);
    return 0.5 * (sample_m(level + 1, low) + sample_m(level + 1, high));
}

float alpha(int level, ivec2 post, vec2 between) {
    if (level == u_coarsest) return 0.0;
    vec2 away_m = (vec2(post - u_middle) + between) * vec2(1.0, -1.0) * u_spacing_m - u_middle_m;
    vec2 from_eye = abs(away_m) / (u_spacing_m * exp2(float(level)));
    vec2 share = clamp((from_eye - (u_reach - u_transition - 1.0)) / u_transition, 0.0, 1.0);
    return max(share.x, share.y);
}

void main() {
    ivec2 cell = min(ivec2(gl_VertexID % (BLOCK + 1), gl_VertexID / (BLOCK + 1)), in_cells.zw), at = in_cells.xy + cell;
    bvec2 along = bvec2(at.y == in_border.y || at.y == in_border.w, at.x == in_border.x || at.x == in_border.z);
    at = on_coarse_edge(at, along, last_sample(in_level));
    ivec2 place = place_of_sample(in_level, at), post = place >> 6;
    vec2 between = vec2(place & 63) / 64.0;
    float a = alpha(in_level, post, between);
    float h_m = any(along) ? sample_m(in_level + 1, at + 1 >> 1) : sample_m(in_level, at);
    if (a > 0.0 && !any(along)) h_m = mix(h_m, coarser_m(in_level, at), a);
    ivec2 low = place_of_sample(in_level, in_cells.xy & ~1) >> 6;
    ivec2 high = place_of_sample(in_level, in_cells.xy + in_cells.zw) + 63 >> 6;
    put_vertex_between(post, between, h_m, Patch(low, high, float(in_level), -1.0));
}
