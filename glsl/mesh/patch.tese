// mesh/patch.tese — a vertex: its post, its height, its place in the picture.

#include "mesh/lattice.glsl"
#include "blocks/view.glsl"

// rows run south, so the plane of tessellation is seen from below
layout(quads, equal_spacing, cw) in;

patch in uvec2 v_shape;
out vec2 v_post;         // column and row on the map
out vec3 v_from_eye_m;   // east, north, up
flat out uvec2 v_patch_shape;

void main() {
    ivec2 post = post_at(lattice_of(v_shape), gl_TessCoord.xy);
    v_post = vec2(post);
    v_from_eye_m = from_eye_m(post, height_m(post));
    v_patch_shape = v_shape;
    gl_Position = u_clip_from_eye * vec4(v_from_eye_m, 1.0);
}
