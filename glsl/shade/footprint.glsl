// shade/footprint.glsl — the footprint of a pixel: the part of the map that it sees.
//   A pixel at view depth z is z/K wide; K is the focal length in drawn pixels. (For an orthographic camera, 1/K.)
//   Projected along the view ray onto the plane of the ground, it is a parallelogram with sides u and v on the map.
//   The footprint is the box around the ellipse inside this parallelogram. Its half sides are √(u² + v²)/2,
//   for columns and for rows.
//   The plane has the slope of a wider neighbourhood, so the footprint depends on the map and the camera,
//   and not on the mesh.
//   Samples see small bumps, so the places that they see jump when the eye moves.
//   To avoid this, places are moved along their rays to the mean ground. For the centre, this is the plane of the
//   whole footprint; for each sample, it is the plane of its part of the footprint.
//   The parts follow the curvature of the ground, and cover equal parts of the picture.
// Provides Ground, footprint_at(), farness(), farness_from(), is_near(), ground_under(), part_of().

#include "shade/relief.glsl"
#include "shade/seen.glsl"

#define PART (SAMPLES > 1 ? 0.5 : 1.0)  // sides of a part, relative to the footprint's

struct Ground {
    vec2 post;
    vec2 extent;      // sides of the footprint in posts, columns and rows
    vec2 u, v;        // sides of the parallelogram, in posts: one pixel right, one pixel up
    int samples;      // the samples, as bits, that see this ground; each sees a part of the footprint
    Relief fine;      // mean height and slope of the footprint
    vec3 from_eye_m;
    vec3 towards_eye;
    float distance_m;
};

#define GRAZING 0.1  // below this cosine, footprints do not grow further

// From this width in posts on, a footprint is shaded by means over the map: of sunlight, and of the ground's lobes.
#ifndef LOBES_FROM
#define LOBES_FROM 1.2  // measured in docs/light.md; pixels with smaller footprints may be NEAR, shaded as one place
#endif
#define SUN_FROM 3.0

// 0 if a footprint is one place, 1 if it is a mean over the map; in between, a blend.
float farness_from(float posts, vec2 extent) {
    return MAY_BE_FAR ? smoothstep(posts, 2.0 * posts, max(extent.x, extent.y)) : 0.0;
}

float farness(vec2 extent) { return farness_from(SUN_FROM, extent); }

#define RELIEF 1.3  // sides of the box over which the relief is averaged, relative to the footprint's

bool is_near(vec2 extent) { return RELIEF * max(extent.x, extent.y) <= FINEST_BOX_POSTS; }

vec3 normal_of(vec2 slope) { return normalize(vec3(-slope, 1.0)); }

vec3 place_from_eye_m(vec2 post, float h_m) {
    vec2 d = post - vec2(u_eye_post);
    vec2 at_m = vec2(d.x, -d.y) * u_spacing_m - u_eye_offset_m;
    return vec3(at_m, up_from_eye_m(h_m) - drop_m(at_m));
}

// The normal in the picture: the Earth's curvature tilts land far away.
vec3 seen_normal(vec2 slope, vec3 place_m) { return normal_of(slope - 2.0 * u_bend_per_m * place_m.xy); }

// A side of the pixel, projected along the ray onto the plane, in posts.
vec2 slide_to_ground(vec3 side_m, vec3 ray, vec3 normal) {
    float slant = dot(ray, normal);
    slant = slant < 0.0 ? min(slant, -GRAZING) : max(slant, GRAZING);
    return (side_m - ray * (dot(side_m, normal) / slant)).xy / u_spacing_m;
}

vec3 direction_to(vec3 place_m) { return is_orthographic() ? u_forward.xyz : normalize(place_m); }

// Metres that a pixel is high, at a view depth.
float pixel_at(float depth_m) { return w_at(max(depth_m, near_m())) * 2.0 * u_half_extent.y / float(u_size_px.y); }

Ground footprint_at(vec2 post) {
    Ground g;
    g.post = post;
    vec3 place_m = place_from_eye_m(post, height_m(ivec2(post)));
    float pixel_m = pixel_at(dot(place_m, u_forward.xyz));
    vec2 around = max(vec2(4.0), 3.0 * pixel_m / u_spacing_m);
    vec3 ray = direction_to(place_m), normal = seen_normal(rough_relief(post, around).slope, place_m);
    g.u = slide_to_ground(u_right.xyz * (pixel_m / u_aspect), ray, normal);
    g.v = slide_to_ground(u_up.xyz * pixel_m, ray, normal);
    g.extent = clamp(sqrt(g.u * g.u + g.v * g.v), vec2(1e-4), vec2(largest_box_posts()));
    return g;
}

// The offset from a place to the point where the ray meets the mean ground;
// 0 near the eye, where the place itself is used.
vec2 shift_to_plane(vec2 post, float h_m, vec2 slope, Ray seen, vec2 extent) {
    vec3 place_m = place_from_eye_m(post, h_m), normal = seen_normal(slope, place_m), ray = seen.along;
    place_m -= seen.start;
    vec3 aside = ray * (dot(place_m, normal) / min(dot(ray, normal), -GRAZING)) - place_m;
    vec2 shift = vec2(aside.x, -aside.y) / u_spacing_m;
    return shift * min(1.0, 1.0 / max(length(shift / extent), 1e-6)) * farness(extent);
}

// The ground under the footprint around a place that samples see along this ray.
Ground ground_under(Ground g, vec2 post, Ray ray) {
    g.fine = relief_of(post, RELIEF * g.extent);
    vec2 shift = shift_to_plane(post, g.fine.height_m, g.fine.slope, ray, g.extent);
    g.post = clamp(post + shift, vec2(0.0), vec2(u_last_post));
    g.fine.height_m += dot(g.fine.slope, vec2(shift.x, -shift.y) * u_spacing_m);
    g.from_eye_m = place_from_eye_m(g.post, g.fine.height_m);
    // there is no air before an orthographic camera: its eye is infinitely far away
    g.distance_m = is_orthographic() ? 1e-6 : max(length(g.from_eye_m), 1e-6);
    g.towards_eye = is_orthographic() ? -u_forward.xyz : -g.from_eye_m / g.distance_m;
    return g;
}

// The part of the footprint that one sample sees, on a plane with the slope of the whole footprint.
vec2 part_on_plane(Ground g, vec2 post, Ray ray) {
    vec2 sides = min(PART * g.extent, largest_box_posts());
    float h_m = rough_relief(post, sides).height_m;
    return clamp(post + shift_to_plane(post, h_m, g.fine.slope, ray, sides), vec2(0.0), vec2(u_last_post));
}

// The centre of the part of the footprint that one of g.samples sees.
vec2 part_of(Ground g, int sample_) {
    vec2 post = post_of_sample(sample_);
    return MAY_BE_FAR ? part_on_plane(g, post, view_ray(offset_of_sample(sample_))) : post;
}
