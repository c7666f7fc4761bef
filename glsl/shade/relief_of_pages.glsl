// shade/relief_of_pages.glsl — shade/relief.glsl for a map of which only some pages are on the GPU. There is no table of heights,
// so a mean is taken over 3 × 3 places of the box. Where pages are coarse, their cells are bilinear, and slopes would jump from cell to
// cell. So the box is not smaller than such a cell.
// Provides Relief, relief_of(), slope_of_cells(), rough_slope(), box_mean_m().

#define LARGEST_BOX_POSTS 250.0
#define FINEST_BOX_POSTS 1.5

struct Relief {
    float height_m;
    vec2 slope;  // metres up per metre east, north
};

float surface_m(vec2 post) {
    vec2 p = clamp(post, vec2(0.0), vec2(u_last_post)), t = fract(p);
    ivec2 at = ivec2(p), next = min(at + 1, u_last_post);
    float north = mix(height_m(at), height_m(ivec2(next.x, at.y)), t.x);
    float south = mix(height_m(ivec2(at.x, next.y)), height_m(next), t.x);
    return mix(north, south, t.y);
}

Relief relief_of(vec2 post, vec2 extent) {
    vec2 half_extent = max(0.5 * extent, vec2(max(0.5 * spacing_at(ivec2(post)), 1.0))), slope = vec2(0.0);
    float sum_m = 0.0;
    for (int y = -1; y <= 1; y++)
        for (int x = -1; x <= 1; x++) {
            float h_m = surface_m(post + vec2(x, y) * half_extent), weight = float(2 - abs(x)) * float(2 - abs(y));
            sum_m += weight * h_m;
            slope += h_m * vec2(x, -y) * vec2(2 - abs(y), 2 - abs(x));
        }
    return Relief(sum_m / 16.0, slope / (8.0 * half_extent * u_spacing_m));
}

// Slope over a place's own extent.
vec2 slope_of_cells(vec2 post, vec2 extent) {
    vec2 aside = max(0.5 * extent, vec2(0.5 * spacing_at(ivec2(post)))), a = clamp(post - aside, vec2(0.0), vec2(u_last_post)), b = clamp(post + aside, vec2(0.0), vec2(u_last_post));
    vec2 east = vec2(surface_m(vec2(a.x, post.y)), surface_m(vec2(b.x, post.y))), south = vec2(surface_m(vec2(post.x, a.y)), surface_m(vec2(post.x, b.y)));
    return vec2(east.y - east.x, south.x - south.y) / (max(b - a, vec2(1e-3)) * u_spacing_m);
}

vec2 rough_slope(vec2 post, vec2 extent) { return relief_of(post, min(extent, LARGEST_BOX_POSTS)).slope; }

float box_mean_m(ivec2 a, ivec2 b) { return relief_of(0.5 * vec2(a + b - 1), vec2(b - a)).height_m; }
