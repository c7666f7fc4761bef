// shade/solid.frag — the first pass of a picture, for a map without voids: depth is all that shading needs of the mesh.

void main() {}
