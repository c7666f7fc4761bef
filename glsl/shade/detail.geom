// shade/detail.geom — pass barycentric weights to each fragment.
//   A weight divided by its screen-space gradient is the distance from the opposite edge in pixels.

layout(triangles) in;
layout(triangle_strip, max_vertices = 3) out;

in vec2 v_post[];
in vec3 v_from_eye_m[];
flat in uvec4 v_of_patch[];
out vec2 g_post;
out vec3 g_from_eye_m;
flat out uvec4 g_of_patch;
out vec3 g_weights;

void main() {
    for (int i = 0; i < 3; i++) {
        g_post = v_post[i];
        g_from_eye_m = v_from_eye_m[i];
        g_of_patch = v_of_patch[i];
        g_weights = vec3(i == 0, i == 1, i == 2);
        gl_Position = gl_in[i].gl_Position;
        gl_ClipDistance[0] = gl_in[i].gl_ClipDistance[0];
        EmitVertex();
    }
    EndPrimitive();
}
