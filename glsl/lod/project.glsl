// lod/project.glsl — from metres of vertical error to pixels, as a bound over a box.
//   A point has camera coordinates (x, y, z); z is its depth.
//   It moves vertically by δ metres, along v = (v_x, v_y, v_z) in the camera's axes. On the screen it moves by
//       K |δ| stretch / w',      stretch = |(a (v_x − x/w · v_w), v_y − y/w · v_w)|,      w' = w + δ v_w
//   In perspective w = z and v_w = v_z; an orthographic camera has w = 1 and v_w = 0. K are the pixels per unit of
//   y/w, and a K those per unit of x/w.
//   Over a box: `stretch` is convex in (x/w, y/w), so it is largest at a corner of the box's projection.
//   w' is at least the nearest corner's w minus |δ v_w|.
//   Only points in the picture count, so the rectangle ends at the picture's edges, and the depth at the near plane.
//   float32 moves each point of the box by at most  a D / w + b  pixels, D its diagonal (docs/precision.md).
// Provides Box, Projection, box_of(), project(), error_px().
// Python twins: reference.project_boxes, reference.error_px; for a point camera.screen_shift_px

#include "blocks/view.glsl"

#define INFINITE_PX 1e30
// bounds rounding errors: of coordinates as large as the distance of the box, and of the bound itself
#define COORDINATE_SLACK 1e-6
#define BOUND_SLACK 1.0005

struct Box {
    vec3 low, high;  // metres east, north, up from the eye
};

struct Projection {
    bool outside;     // no part of the box is in the picture
    bool inside;      // the whole box is in the picture
    float nearest_m;  // smallest w of a point in the picture
    float stretch;    // its largest value in the box
    float middle_m;   // w of the box's centre, at least nearest_m
    float rounding_px;  // what float32 adds on the screen, in narrow views
    float sag_m;      // what curvature and rounding add to errors in the box: 0, unless the caller sets it
};

Box box_of(ivec2 low_post, ivec2 high_post, vec2 range_m) {
    vec2 a = post_from_eye_m(low_post), b = post_from_eye_m(high_post), low = vec2(a.x, b.y), high = vec2(b.x, a.y);
    vec2 nearest = clamp(vec2(0.0), low, high), farthest = max(abs(low), abs(high));
    return Box(vec3(low, up_from_eye_m(range_m.x) - drop_m(farthest)),
        vec3(high, up_from_eye_m(range_m.y) - drop_m(nearest)));
}

vec3 to_camera(vec3 p) { return vec3(dot(u_right.xyz, p), dot(u_up.xyz, p), dot(u_forward.xyz, p)); }

// Bounds the rounding errors of `beyond`, at a place whose coordinates have the errors `slack`.
vec2 slack_of_edges(float slack, vec2 extent) {
    return is_orthographic() ? slack + COORDINATE_SLACK * extent : slack * (1.0 + extent);
}

// `margin` ≥ 1 widens the frustum: a box outside a wide frustum is outside a narrow one, in spite of rounding.
Projection project(Box box, float margin) {
    if (u_metric == METRIC_METRES) return Projection(false, true, 0.0, 0.0, 0.0, 0.0, 0.0);  // there is no picture
    // How far the corners lie beyond the picture's right, top, left and bottom: minimum and maximum over the corners.
    vec4 least_beyond = vec4(1e30), most_beyond = vec4(-1e30);
    float nearest = 1e30, farthest = -1e30, near = near_m();
    vec2 extent = abs(u_centre) + u_half_extent;
    vec2 low = vec2(1e30), high = vec2(-1e30);
    for (int i = 0; i < 8; i++) {
        vec3 p = mix(box.low, box.high, bvec3(i & 1, i & 2, i & 4));  // with bvec3, mix() selects and does not round
        vec3 q = to_camera(p);
        float slack = COORDINATE_SLACK * margin * (abs(p.x) + abs(p.y) + abs(p.z));
        float w = w_at(q.z);
        vec2 aside = q.xy - u_centre * w;
        vec4 beyond = vec4(aside, -aside) - (u_half_extent * w).xyxy, slack_beyond = slack_of_edges(slack, extent).xyxy;
        least_beyond = min(least_beyond, beyond - slack_beyond);
        most_beyond = max(most_beyond, beyond + slack_beyond);
        nearest = min(nearest, q.z - slack);
        farthest = max(farthest, q.z + slack);
        low = min(low, q.xy / w);
        high = max(high, q.xy / w);
    }
    bool all_near = farthest < near, any_near = nearest < near;
    extent *= 1.0001;
    vec2 first = u_centre - u_half_extent * 1.0001, last = u_centre + u_half_extent * 1.0001;
    low = any_near ? first : clamp(low, first, last);
    high = any_near ? last : clamp(high, first, last);
    vec3 v = vec3(u_right.z, u_up.z, vertical_w());
    vec2 a = abs(v.xy - low * v.z), b = abs(v.xy - high * v.z);
    Projection projection;
    projection.outside = all_near || any(greaterThan(least_beyond, vec4(0.0)));
    projection.inside = !any_near && all(lessThanEqual(most_beyond, vec4(0.0)));
    projection.nearest_m = w_at(max(nearest, 0.999 * near));
    projection.middle_m = max(projection.nearest_m, w_at(dot(u_forward.xyz, 0.5 * (box.low + box.high))));
    projection.rounding_px = u_rounding_px.x * length(box.high - box.low) / projection.nearest_m + u_rounding_px.y;
    projection.sag_m = 0.0;
    // if the view is vertical the two parts of the difference cancel, but not their rounding errors
    projection.stretch = length(max(a, b) * vec2(u_aspect, 1.0))
        + COORDINATE_SLACK * max(u_aspect, 1.0) * (1.0 + (is_orthographic() ? 0.0 : dot(extent, extent)));
    return projection;
}

// Pixels for an error of size_m; max_m is the largest error of the box. Both are without the sag.
float error_px(Projection p, float size_m, float max_m) {
    size_m += p.sag_m;
    if (size_m == 0.0) return p.rounding_px;
    float depth = p.nearest_m - (max_m + p.sag_m) * abs(vertical_w());
    return depth <= 0.0 ? INFINITE_PX : u_focal_px * size_m * p.stretch / depth * BOUND_SLACK + p.rounding_px;
}
