// driver/pattern.vert — a patch is one vertex: the segments of its edges, those inside, and its number.

in vec4 in_edges;
in vec2 in_inside;
out vec4 v_edges;
out vec2 v_inside;

void main() {
    v_edges = in_edges;
    v_inside = in_inside;
}
