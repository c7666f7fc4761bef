// blocks/view.glsl — the camera for every stage. Positions are metres east, north and up from the eye:
//   floats are precise near the eye, even if the eye is far from the map's corner.
//   The Earth is round: at the distance r from the eye, a post is drawn lower by its drop r² / 2R.
//   Between posts the drop is bilinear, like the heights.
//   For a place between posts, let f and g be its fractions of the way to the next post, east and south. Its drop is
//       r² / 2R + f (1 - f) s_x² / 2R + g (1 - g) s_y² / 2R.
//   So the drop of a cell of the map is a plane, which adds no error.
//   The drops lower a triangle in a cell of 2^j posts, j ≥ 1, more than the posts under it, by the cell's sag at most:
//     4^j (s_x² + s_y²) / 8R       (docs/guarantee.md, section 8)
//   A place (x, y, z) along the camera's axes is in the picture at (x/w, y/w). In perspective w = z. An orthographic
//   camera has w = 1 m, and all its rays are parallel.
// Python twins: gpu.layout.VIEW; reference.drop_m, reference.largest_sag_m

#include "blocks/terrain.glsl"

layout(std140, binding = 1) uniform View {
    mat4 u_clip_from_eye;
    vec4 u_right, u_up, u_forward;  // unit vectors of the picture, xyz
    ivec2 u_eye_post;               // a post near the eye
    vec2 u_eye_offset_m;            // offset from that post to the eye
    vec2 u_half_extent;             // half the picture, across and up, in units of x/w and y/w
    ivec2 u_size_px;                // size of the whole picture in drawn pixels
    ivec2 u_first_px;               // lower left pixel of the piece that is drawn now
    float u_eye_z_m;                // the eye's height above the base; then the part of it that float32 loses
    float u_eye_z_rest_m;
    float u_focal_px;               // pixels per unit of y/w
    float u_tolerance_px;           // 0: every cell at full resolution
    int u_metric;                   // METRIC_...
    int u_cull;                     // leave out patches outside the picture
    float u_bend_per_m;             // 1 / 2R; 0 if the ground is flat
    float u_sag_m;                  // (s_x² + s_y²) / 8R
    vec2 u_bulge_m;                 // s_x² / 2R, s_y² / 2R
    ivec4 u_piece_px;               // xy: size of the piece that is drawn now, in drawn pixels; zw: of its viewport
    vec2 u_centre;                  // x/w, y/w in the middle of the picture; 0 if the eye looks there
    float u_aspect;                 // pixels per unit of x/w, relative to u_focal_px; 1 for square pixels
    float u_depth_span_m;           // orthographic cameras: view depth from the nearest to the farthest land; else 0
    vec4 u_rounding_px;             // narrow views: a and b of lod/project.glsl; else 0
};

#define METRIC_MAX 0
#define METRIC_RMS 1
#define METRIC_METRES 2  // metres of height, over the whole map, without a camera

// Position of a fragment in the whole picture, in drawn pixels.
vec2 picture_px(vec4 frag_coord) { return frag_coord.xy + vec2(u_first_px); }

vec2 post_from_eye_m(ivec2 post) {
    ivec2 d = post - u_eye_post;
    return vec2(d.x, -d.y) * u_spacing_m - u_eye_offset_m;
}

#ifndef PARALLEL  // each kind of camera has shading programs of its own: every pixel asks
#define PARALLEL (u_depth_span_m > 0.0)
#endif
bool is_orthographic() { return PARALLEL; }
// What x and y are divided by, at a view depth.
float w_at(float z) { return is_orthographic() ? 1.0 : z; }
float vertical_w() { return is_orthographic() ? 0.0 : u_forward.z; }  // v_w of lod/project.glsl

// Distance of the near plane; depth is near_m() / z. An orthographic camera shows all land in front of the eye.
float near_m() { return is_orthographic() ? 0.0 : u_clip_from_eye[3].z; }

// The eye's height is the sum of two floats, because one is not precise enough. Each is subtracted on its own.
float up_from_eye_m(float h_m) {
    precise float up_m = (h_m - u_eye_z_m) - u_eye_z_rest_m;
    return up_m;
}

// How much lower a post at this place is drawn.
float drop_m(vec2 from_eye_m) { return u_bend_per_m * dot(from_eye_m, from_eye_m); }

// The drop of a place that is these fractions of the way from its post to the next post.
float drop_between_m(vec2 from_eye_m, vec2 between) {
    return drop_m(from_eye_m) + dot(u_bulge_m, between * (1.0 - between));
}

// The largest sag of a triangle in a cell of 2^level posts.
float sag_m(int level) { return level < 1 ? 0.0 : u_sag_m * exp2(2.0 * float(level)); }
