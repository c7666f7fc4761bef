// shade/solid.frag — the first pass of a picture, for a map without voids. Shading needs only depth from the mesh.

void main() {}
