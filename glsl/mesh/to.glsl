// mesh/to.glsl — where a method's vertices go. TO names the destination:
//   PICTURE   its place in the picture, and on the map for whom shades it
//   ABOVE     seen from straight above, PLACES pixels a post, a tile of the map at a time: what mesh/error.frag measures.
//             A place on a triangle's edge belongs to one side only, by the rasteriser's rule, and on the map's far edges
//             to none; u_flip turns the picture, so that every edge is a near one in one of four draws.
//   CAPTURE   a buffer, as the mesh export wants it
// Provides PICTURE, ABOVE, CAPTURE, TO, and is_beside().

#define PICTURE 0
#define ABOVE 1
#define CAPTURE 2
#ifndef TO
#define TO PICTURE
#endif

#if TO == ABOVE

uniform ivec2 u_tile;       // place of the picture's first pixel, in PLACES a post
uniform ivec2 u_tile_size;  // pixels
uniform ivec2 u_flip;

// Whether what lies between two posts leaves the picture as it is.
bool is_beside(ivec2 low, ivec2 high) {
    return any(lessThan(PLACES * high, u_tile)) || any(greaterThanEqual(PLACES * low, u_tile + u_tile_size));
}

#else

bool is_beside(ivec2 low, ivec2 high) { return false; }

#endif
