// shade/error.frag — style "error": the error of the surface in pixels. Black is 0, pale yellow the end of the scale;
//   errors above the scale are cyan; land is grey where the map has no data, or where the true heights of a store are
//   not loaded. The bar at the lower left shows the colours of the scale; the window has a legend instead.

#include "shade/drawn.glsl"
#include "shade/marks.glsl"

vec3 ground_colour(Ground g, int sample_) {
    if (MARKED && is_hole(min(ivec2(g.post), u_last_post - 1))) return vec3(0.5) * clay(g);
    float worst_px = 0.0, least_px = 0.0;
    for (int i = 0; i < SAMPLES; i++) {
        float px = is_sky(post_of_sample(i)) ? 0.0 : drawn_at(i).px;
        worst_px = max(worst_px, px);
        least_px = min(least_px, px);
    }
    if (least_px < 0.0) return vec3(0.5) * clay(g);
    return error_colour(worst_px) * (0.65 + 0.35 * clay(g));
}

uniform bool u_bar;

vec3 with_bar(vec3 colour) {
    if (!u_bar) return colour;
    vec2 size = vec2(u_size_px) * vec2(0.2, 0.02), at = (picture_px(FRAG_COORD) - 0.03 * float(u_size_px.y)) / size;
    vec2 rim = abs(at - 0.5) * size - 0.5 * size;
    if (max(rim.x, rim.y) >= 1.0) return colour;
    g_open = 0;  // the bar hides the sky
    return all(greaterThan(at, vec2(0.0))) && all(lessThan(at, vec2(1.0))) ? inferno(0.08 + 0.92 * at.x) : vec3(1.0);
}

#define SKY_COLOUR vec3(0.60)
#define SHOWN with_bar
#include "shade/pixel.glsl"
