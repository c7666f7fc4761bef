// shade/detail.frag — the first pass for styles that show the mesh; it also stores the error at each sample, in pixels.

#include "shade/detail.glsl"

#ifdef PAGED
// Whether the page of level 0 over a post is loaded: only then is the post's own height known.
bool is_known(ivec2 post) { return finest_over(min(post >> PAGE_LOG2, pages_of(0) - 1)) >> 24 == 0u; }

bool is_known_cell(ivec2 at) {
    return is_known(at) && is_known(at + 1) && is_known(at + ivec2(1, 0)) && is_known(at + ivec2(0, 1));
}
#else
bool is_known_cell(ivec2 at) { return true; }
#endif

// Distance of the drawn height from the range between the two triangulations of a cell: 0 inside this range.
float error_m(vec2 post, float drawn_m) {
    ivec2 at = min(ivec2(post), u_last_post - 1);
    vec2 t = post - vec2(at);
    float a = height_m(at), b = height_m(at + ivec2(1, 0)), c = height_m(at + ivec2(0, 1)), d = height_m(at + 1);
    float falling = t.x >= t.y ? a + (b - a) * t.x + (d - b) * t.y : a + (c - a) * t.y + (d - c) * t.x;
    float rising = t.x + t.y <= 1.0 ? a + (b - a) * t.x + (c - a) * t.y
        : d + (c - d) * (1.0 - t.x) + (b - d) * (1.0 - t.y);
    return drawn_m - clamp(drawn_m, min(falling, rising), max(falling, rising));
}

// Exact distance on the screen between the drawn point and the true point, d metres below it: see lod/project.glsl.
float error_px(vec3 drawn_m, float d) {
    float w = w_at(dot(drawn_m, u_forward.xyz)), true_w = w - d * vertical_w();
    vec2 at = vec2(dot(drawn_m, u_right.xyz), dot(drawn_m, u_up.xyz));
    vec2 moved = (vec2(u_right.z, u_up.z) * w - at * vertical_w()) * vec2(u_aspect, 1.0);
    return u_focal_px * abs(d) * length(moved) / max(w * abs(true_w), 1e-30);
}

void main() {
    // A place outside the triangle belongs to the fragment of a neighbour.
    bool inside = min(min(g_weights.x, g_weights.y), g_weights.z) >= 0.0;
    vec2 post = place_in_patch(g_post, patch_of(g_of_patch));
    float drop = drop_between_m(g_from_eye_m.xy, fract(post));
    float drawn_m = g_from_eye_m.z + drop + u_eye_z_m + u_eye_z_rest_m;
    float px = inside ? error_px(g_from_eye_m, error_m(post, drawn_m)) : 0.0;
    put_detail(is_known_cell(min(ivec2(post), u_last_post - 1)) ? px : -1.0);
}
