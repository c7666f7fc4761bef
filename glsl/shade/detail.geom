// shade/detail.geom — tell each fragment how far it is from its triangle's edges, in pixels: a corner is as far from the
// opposite edge as the triangle is high there, and distances run evenly over the screen (Baerentzen et al. 2006,
// "Single-pass wireframe rendering").

#include "blocks/view.glsl"

layout(triangles) in;
layout(triangle_strip, max_vertices = 3) out;

in vec2 v_post[];
in vec3 v_from_eye_m[];
flat in uvec2 v_patch_shape[];
out vec2 g_post;
out vec3 g_from_eye_m;
flat out uvec2 g_patch_shape;
noperspective out vec3 g_edge_px;
flat out float g_height_px;  // least height of the triangle

uniform ivec2 u_size_px;

vec2 pixel_of(vec4 clip) { return 0.5 * vec2(u_size_px) * clip.xy / clip.w; }

vec3 heights_px() {
    if (min(min(gl_in[0].gl_Position.w, gl_in[1].gl_Position.w), gl_in[2].gl_Position.w) < near_m()) return vec3(1e4);
    vec2 a = pixel_of(gl_in[0].gl_Position), b = pixel_of(gl_in[1].gl_Position), c = pixel_of(gl_in[2].gl_Position);
    float doubled_area = abs((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x));
    return doubled_area / max(vec3(distance(b, c), distance(c, a), distance(a, b)), 1e-6);
}

void main() {
    vec3 heights = heights_px();
    for (int i = 0; i < 3; i++) {
        g_post = v_post[i];
        g_from_eye_m = v_from_eye_m[i];
        g_patch_shape = v_patch_shape[i];
        g_height_px = min(min(heights.x, heights.y), heights.z);
        g_edge_px = g_height_px > 9e3 ? vec3(1e4) : vec3(i == 0, i == 1, i == 2) * heights;
        gl_Position = gl_in[i].gl_Position;
        EmitVertex();
    }
    EndPrimitive();
}
