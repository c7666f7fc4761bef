// error/classes.glsl — error classes, half an octave each; tiles of nodes are counted that are above a class's limit.
//   Class 0 has the largest limit; limits go down to a millionth of the map's span.
// Provides class_limit_m().   Python twin: layout.CLASSES, layout.COUNT_TILE

#ifndef CLASSES
#define CLASSES 40
#endif
#ifndef COUNT_TILE
#define COUNT_TILE 4
#endif

float class_limit_m(int c) { return u_span_m * exp2(-0.5 * float(c) - 0.5); }
