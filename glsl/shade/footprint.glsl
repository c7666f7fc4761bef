// shade/footprint.glsl — what part of the map a pixel sees.
//   A pixel at view depth z is z/K wide, K counting pixels as they are drawn; slid along the view ray onto the ground's own plane, it is a parallelogram of
//   sides u, v on the map, and the box around its ellipse has half sides √(u² + v²)/2, column and row. The plane is that
//   of a wider neighbourhood: the footprint depends on the map and the camera, never on the mesh.
// Provides Ground, ground_at(), view_ray().

#include "blocks/view.glsl"
#include "shade/relief.glsl"

struct Ground {
    vec2 post;
    vec2 extent;      // sides of the footprint in posts, columns and rows
    Relief fine;      // of the footprint
    vec3 from_eye_m;
    vec3 towards_eye;
    float distance_m;
};

#define GRAZING 0.1  // cosine beyond which footprints grow no longer

vec3 view_ray() {
    vec2 at = (picture_px(gl_FragCoord) / vec2(u_size_px) * 2.0 - 1.0) * u_half_extent;
    return normalize(u_forward.xyz + at.x * u_right.xyz + at.y * u_up.xyz);
}

vec3 normal_of(vec2 slope) { return normalize(vec3(-slope, 1.0)); }

vec3 place_from_eye_m(vec2 post, float h_m) {
    vec2 d = post - vec2(u_eye_post);
    return vec3(vec2(d.x, -d.y) * u_spacing_m - u_eye_offset_m, up_from_eye_m(h_m));
}

// A side of the pixel, slid along the ray onto the plane: posts on the map.
vec2 slide_to_ground(vec3 side_m, vec3 ray, vec3 normal) {
    float slant = dot(ray, normal);
    slant = slant < 0.0 ? min(slant, -GRAZING) : max(slant, GRAZING);
    return (side_m - ray * (dot(side_m, normal) / slant)).xy / u_spacing_m;
}

Ground ground_at(vec2 post) {
    Ground g;
    g.post = post;
    vec3 place_m = place_from_eye_m(post, height_m(ivec2(post)));
    float pixel_m = max(dot(place_m, u_forward.xyz), near_m()) * 2.0 * u_half_extent.y / float(u_size_px.y);
    vec2 around = max(vec2(4.0), 3.0 * pixel_m / u_spacing_m);
    vec3 ray = normalize(place_m), normal = normal_of(rough_slope(post, around));
    vec2 u = slide_to_ground(u_right.xyz * pixel_m, ray, normal), v = slide_to_ground(u_up.xyz * pixel_m, ray, normal);
    g.extent = clamp(sqrt(u * u + v * v), vec2(1e-4), vec2(LARGEST_BOX_POSTS));
    g.fine = relief_of(post, 1.3 * g.extent);
    g.from_eye_m = place_from_eye_m(post, g.fine.height_m);
    g.distance_m = max(length(g.from_eye_m), 1e-6);
    g.towards_eye = -g.from_eye_m / g.distance_m;
    return g;
}
