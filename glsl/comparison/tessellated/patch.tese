// comparison/tessellated/patch.tese — a vertex:
//   the post, or the part of a cell, nearest to the tessellator's coordinate, and the height there.
//   Both sides of an edge round the same whole numbers, so there are no cracks.
//   Heights are filtered over half a segment, so that ground between vertices has an influence.
//   They come from the pyramid's level λ = log2(segment / 2 spacing), linear between levels:
//   a function of the place and the view, not of the patch.

#include "comparison/clipmap/pyramid.glsl"
#include "comparison/tessellated/patch.glsl"
#include "comparison/tessellated/measures.glsl"
#include "mesh/vertex.glsl"

layout(quads, equal_spacing, cw) in;  // rows count to the south

patch in uvec4 v_cut;

// The end of the k-th of `steps` equal steps along an edge, in 64ths of a post.
// If there are at most as many steps as posts, this is a post.
int step_to(int k, int steps, int posts) {
    int whole = u_parts == 1 || steps <= posts ? 64 : 1, n = 64 / whole * posts;
    return (2 * k * n + steps) / (2 * steps) * whole;
}

int along_edge(float t, int segments, int first_half, int half_, int posts) {
    int k = int(round(t * float(segments)));
    if (first_half == 0) return step_to(k, segments, posts);
    return k <= first_half ? step_to(k, first_half, half_)
                           : 64 * half_ + step_to(k - first_half, segments - first_half, posts - half_);
}

ivec2 place_in(Cut c, vec2 t) {
    ivec2 inner = inner_levels(c), half_ = ivec2(1) << max(findMSB(c.size - 1), 0), at;
    int across = t.y == 0.0 ? 1 : 3, down = t.x == 0.0 ? 0 : 2;  // the edges that the vertex may be on
    bool on_across = t.y == 0.0 || t.y == 1.0, on_down = t.x == 0.0 || t.x == 1.0;
    at.x = on_across ? along_edge(t.x, c.outer[across], c.first_half[across], half_.x, c.size.x)
                     : step_to(int(round(t.x * float(inner.x))), inner.x, c.size.x);
    at.y = on_down ? along_edge(t.y, c.outer[down], c.first_half[down], half_.y, c.size.y)
                   : step_to(int(round(t.y * float(inner.y))), inner.y, c.size.y);
    return (c.low << 6) + at;
}

// The pyramid's level at a place, bilinear between its samples.
float level_m(int level, ivec2 place) {
    ivec2 i = min(place >> level + 6, last_sample(level) - 1);
    ivec2 low = place_of_sample(level, i);
    ivec2 high = place_of_sample(level, i + 1);
    vec2 t = vec2(place - low) / vec2(high - low);
    float north = mix(sample_m(level, i), sample_m(level, i + ivec2(1, 0)), t.x);
    return mix(north, mix(sample_m(level, i + ivec2(0, 1)), sample_m(level, i + 1), t.x), t.y);
}

float filtered_m(ivec2 place) {
    ivec2 post = place >> 6;
    vec2 between = vec2(place & 63) / 64.0;
    float h_m = bilinear_m(post, between);
    float level = log2(0.5 * u_edge * length(from_middle_m(post, between, h_m))
        * inversesqrt(u_spacing_m.x * u_spacing_m.y));
    level = clamp(level, 0.0, float(u_top_level));
    int below = int(level);
    float finer = below == 0 ? h_m : level_m(below, place);
    return below == u_top_level ? finer : mix(finer, level_m(below + 1, place), fract(level));
}

void main() {
    Cut c = cut_of(v_cut);
    ivec2 place = place_in(c, gl_TessCoord.xy);
    vec2 segment = vec2(c.size) / vec2(inner_levels(c));
    put_vertex_between(place >> 6, vec2(place & 63) / 64.0, filtered_m(place),
                       Patch(c.low, c.low + c.size, log2(max(segment.x, segment.y)), -1.0));
}
