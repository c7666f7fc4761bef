// blocks/view.glsl — what every stage knows of the camera. Positions are metres east, north, up from the eye: near it
// floats are fine, however far the eye is from the map's corner.
// Python twin: gpu.layout.VIEW

#include "blocks/terrain.glsl"

layout(std140, binding = 1) uniform View {
    mat4 u_clip_from_eye;
    vec4 u_right, u_up, u_forward;  // unit vectors of the picture, xyz
    ivec2 u_eye_post;               // a post near the eye, and the eye from there
    vec2 u_eye_offset_m;
    vec2 u_half_extent;             // largest |x/z|, |y/z| in the picture
    ivec2 u_size_px;                // of the whole picture, as it is drawn: a piece of it may be at hand, and
    ivec2 u_first_px;               // begins there, from the lower left; drawn finer it has more than u_focal_px counts
    float u_eye_z_m;                // the eye's height, and what of it a float does not hold
    float u_eye_z_rest_m;
    float u_focal_px;               // pixels per unit of x/z
    float u_tolerance_px;           // 0: every cell at full resolution
    int u_metric;                   // one of these
    int u_cull;                     // leave out what the picture does not show
};

#define METRIC_MAX 0
#define METRIC_RMS 1
#define METRIC_METRES 2  // of height, over the whole map, from no eye

// Where in the whole picture a fragment of the piece at hand is, in drawn pixels.
vec2 picture_px(vec4 frag_coord) { return frag_coord.xy + vec2(u_first_px); }

vec2 post_from_eye_m(ivec2 post) {
    ivec2 d = post - u_eye_post;
    return vec2(d.x, -d.y) * u_spacing_m - u_eye_offset_m;
}

// Reversed depth: near plane over depth.
float near_m() { return u_clip_from_eye[3].z; }

float up_from_eye_m(float h_m) { return (h_m - u_eye_z_m) - u_eye_z_rest_m; }

vec3 from_eye_m(ivec2 post, float h_m) { return vec3(post_from_eye_m(post), up_from_eye_m(h_m)); }
