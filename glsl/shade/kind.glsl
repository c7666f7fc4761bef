// shade/kind.glsl — kinds of pixels. Each kind has its own program, which leaves out code that its pixels never need.
//   OPEN    all samples see the open sky, beyond the surroundings of the map
//   SKY     no sample sees land
//   NEAR    all samples see the same ground, and the footprint is about a cell or smaller: one place, by splines
//   MIXED   an edge passes through the pixel, or the footprint is larger: shaded by means from tables
//   ANY     a program for all pixels
// shade/kind.frag finds the kind of each pixel.
// Provides PIXELS, MAY_BE_FAR.   Python twin: shade.programs.KINDS

#define ANY 0
#define SKY 1
#define NEAR 2
#define MIXED 3
#define OPEN 4

#ifndef PIXELS
#define PIXELS ANY
#endif

const bool MAY_BE_FAR = PIXELS != NEAR;
