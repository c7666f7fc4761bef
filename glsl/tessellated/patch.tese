// tessellated/patch.tese — a vertex: the post nearest to the tessellator's coordinate, and the height there.
//   Both sides of an edge round the same whole numbers, so there are no cracks.
//   Heights are filtered over half a segment, so that ground between vertices has an influence. They come from the pyramid's
//   level λ = log2(segment / 2 spacing), linear between levels: a function of the post and the view, not of the patch.

#include "clipmap/pyramid.glsl"
#include "tessellated/patch.glsl"
#include "tessellated/measures.glsl"
#include "mesh/vertex.glsl"

layout(quads, equal_spacing, cw) in;  // rows run south

patch in uvec4 v_patch;

// The k-th of `steps` equal steps along an edge, rounded to the nearest post.
int step_to(int k, int steps, int posts) { return (2 * k * posts + steps) / (2 * steps); }

int along_edge(float t, int segments, int first_half, int half_, int posts) {
    int k = int(round(t * float(segments)));
    if (first_half == 0) return step_to(k, segments, posts);
    return k <= first_half ? step_to(k, first_half, half_)
                           : half_ + step_to(k - first_half, segments - first_half, posts - half_);
}

ivec2 post_in(Cut c, vec2 t) {
    ivec2 inner = inner_levels(c.outer), half_ = ivec2(1) << max(findMSB(c.size - 1), 0), at;
    int across = t.y == 0.0 ? 1 : 3, down = t.x == 0.0 ? 0 : 2;  // the edge that it may be on
    bool on_across = t.y == 0.0 || t.y == 1.0, on_down = t.x == 0.0 || t.x == 1.0;
    at.x = on_across ? along_edge(t.x, c.outer[across], c.first_half[across], half_.x, c.size.x)
                     : step_to(int(round(t.x * float(inner.x))), inner.x, c.size.x);
    at.y = on_down ? along_edge(t.y, c.outer[down], c.first_half[down], half_.y, c.size.y)
                   : step_to(int(round(t.y * float(inner.y))), inner.y, c.size.y);
    return c.low + at;
}

// The pyramid's level at a post, bilinear between its samples.
float level_m(int level, ivec2 post) {
    ivec2 i = min(post >> level, last_sample(level) - 1), low = post_of_sample(level, i), high = post_of_sample(level, i + 1);
    vec2 t = vec2(post - low) / vec2(high - low);
    float north = mix(sample_m(level, i), sample_m(level, i + ivec2(1, 0)), t.x);
    return mix(north, mix(sample_m(level, i + ivec2(0, 1)), sample_m(level, i + 1), t.x), t.y);
}

float filtered_m(ivec2 post) {
    float h_m = height_m(post);
    float level = log2(0.5 * u_edge * length(from_middle_m(post, h_m)) * inversesqrt(u_spacing_m.x * u_spacing_m.y));
    level = clamp(level, 0.0, float(u_top_level));
    int below = int(level);
    float finer = below == 0 ? h_m : level_m(below, post);
    return below == u_top_level ? finer : mix(finer, level_m(below + 1, post), fract(level));
}

void main() {
    Cut c = cut_of(v_patch);
    ivec2 post = post_in(c, gl_TessCoord.xy);
    vec2 segment = vec2(c.size) / vec2(inner_levels(c.outer));
    put_vertex(post, filtered_m(post), Patch(c.low, c.low + c.size, log2(max(segment.x, segment.y)), false, 0u, -1.0));
}
