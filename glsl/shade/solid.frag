// shade/solid.frag — the first pass of a picture if no cell is a hole, and the style does not show the mesh.
//   It stores only depth: the second pass needs nothing else.

void main() {}
