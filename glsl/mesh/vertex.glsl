// mesh/vertex.glsl — writes a vertex, from its post and its height, to the destination that mesh/to.glsl names.
// Provides put_vertex_between(), which every method's last stage before the rasteriser calls in its last line.

#include "mesh/patch.glsl"
#include "mesh/to.glsl"
#include "blocks/view.glsl"

#if TO == PICTURE

out vec2 v_post;         // column and row on the map
out vec3 v_from_eye_m;   // east, north, up
flat out uvec4 v_of_patch;

// From clip coordinates of the piece to those of the viewport, which has a margin around the piece.
// Rasterisers round vertices to 1/256 of a pixel, but some compute depth from the unrounded vertices. Then a triangle
// that is seen edge-on may get a depth far outside the depths of its corners, even below 0, and its sample is lost. So
// we round vertices here already.
vec4 in_viewport(vec4 clip) {
    vec2 at = clip.xy * u_piece_px.xy;
#ifndef AS_COMPUTED
    if (clip.w > 0.0) at = round(clip.xy / clip.w * 128.0 * u_piece_px.xy) / 128.0 * clip.w;
#endif
    return vec4(at / u_piece_px.zw, clip.zw);
}

// A vertex between posts: `between` is the way from its post, east and south, as fractions of a cell.
void put_vertex_between(ivec2 post, vec2 between, float h_m, Patch p) {
    v_post = vec2(post) + between;
    vec2 at_m = post_from_eye_m(post) + vec2(between.x, -between.y) * u_spacing_m;
    v_from_eye_m = vec3(at_m, up_from_eye_m(h_m) - drop_between_m(at_m, between));
    v_of_patch = words_of(p);
    gl_Position = in_viewport(u_clip_from_eye * vec4(v_from_eye_m, 1.0));
    gl_ClipDistance[0] = (is_orthographic() ? dot(u_forward.xyz, v_from_eye_m) : gl_Position.w) - near_m();
}

#else

out vec3 v_vertex;  // column, row, metres above base

void put_vertex_between(ivec2 post, vec2 between, float h_m, Patch p) {
    v_vertex = vec3(vec2(post) + between, h_m);
#if TO == ABOVE
    vec2 pixel = vec2(PLACES * post - u_tile) + float(PLACES) * between + 0.5;
    pixel = mix(pixel, vec2(u_tile_size) - pixel, vec2(u_flip));
    gl_Position = vec4(pixel / vec2(u_tile_size) * 2.0 - 1.0, 0.0, 1.0);
#endif
}

#endif
