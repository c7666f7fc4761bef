// mesh/star.vert — one vertex for each patch that lod/star.py looks at.

flat out int v_number;

void main() { v_number = gl_VertexID; }
