// mesh/to.glsl — where a method's vertices go. TO names the destination:
//   PICTURE   the picture; the vertex also has its place on the map, for shading
//   ABOVE     a view from straight above with PLACES pixels for each post, one tile of the map at a time:
//             mesh/error.frag measures it. The rasteriser gives a place on an edge to only one triangle, and gives some
//             places on the map's rims to none. u_flip mirrors the picture: each rim is covered in one of four draws.
//   CAPTURE   a buffer, for the mesh export
// Provides PICTURE, ABOVE, CAPTURE, TO, and is_beside().

#define PICTURE 0
#define ABOVE 1
#define CAPTURE 2
#ifndef TO
#define TO PICTURE
#endif

#if TO == ABOVE

uniform ivec2 u_tile;       // the place of the picture's first pixel
uniform ivec2 u_tile_size;  // pixels
uniform ivec2 u_flip;

// Whether a rectangle of posts lies outside the tile.
bool is_beside(ivec2 low, ivec2 high) {
    return any(lessThan(PLACES * high, u_tile)) || any(greaterThanEqual(PLACES * low, u_tile + u_tile_size));
}

#else

bool is_beside(ivec2 low, ivec2 high) { return false; }

#endif
