// mesh/triangle.geom — pass the whole triangle to each fragment.

layout(triangles) in;
layout(triangle_strip, max_vertices = 3) out;

in vec3 v_vertex[];
flat out vec3 v_a, v_b, v_c;

void main() {
    for (int i = 0; i < 3; i++) {
        v_a = v_vertex[0];
        v_b = v_vertex[1];
        v_c = v_vertex[2];
        gl_Position = gl_in[i].gl_Position;
        EmitVertex();
    }
    EndPrimitive();
}
