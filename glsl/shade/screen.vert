// shade/screen.vert — one triangle that covers the picture, at the depth of the pixels' kind: see shade/kind.frag.

#include "shade/kind.glsl"

void main() {
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    gl_Position = vec4(4.0 * corner - 1.0, float(PIXELS) / 8.0, 1.0);
}
