// blocks/view.glsl — the camera for every stage. Positions are metres east, north and up from the eye: floats are precise
// near the eye, even if the eye is far from the map's corner.
// Python twin: gpu.layout.VIEW

#include "blocks/terrain.glsl"

layout(std140, binding = 1) uniform View {
    mat4 u_clip_from_eye;
    vec4 u_right, u_up, u_forward;  // unit vectors of the picture, xyz
    ivec2 u_eye_post;               // a post near the eye; then the offset from that post to the eye
    vec2 u_eye_offset_m;
    vec2 u_half_extent;             // largest |x/z|, |y/z| in the picture
    ivec2 u_size_px;                // size of the whole picture in drawn pixels
    ivec2 u_first_px;               // lower left pixel of the piece that is drawn now
    float u_eye_z_m;                // the eye's height above the base; then the part of it that float32 loses
    float u_eye_z_rest_m;
    float u_focal_px;               // pixels per unit of x/z
    float u_tolerance_px;           // 0: every cell at full resolution
    int u_metric;                   // METRIC_...
    int u_cull;                     // leave out patches outside the picture
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

// Reversed depth: distance of the near plane / view depth.
float near_m() { return u_clip_from_eye[3].z; }

float up_from_eye_m(float h_m) { return (h_m - u_eye_z_m) - u_eye_z_rest_m; }

vec3 from_eye_m(ivec2 post, float h_m) { return vec3(post_from_eye_m(post), up_from_eye_m(h_m)); }
