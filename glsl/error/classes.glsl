// error/classes.glsl — error classes, a quarter of an octave each; tiles of nodes are counted that are above a class's limit.
//   Class 0 has the largest limit; limits go down to 2^-16 of the map's span.
// Provides class_limit_m(), count_tile().   CLASSES, COUNT_TILE: gpu/layout.py

float class_limit_m(int c) { return u_span_m * exp2(-0.25 * float(c) - 0.25); }

// Nodes a side of a tile; cells of the map, level 0, are more than all others together, and get larger ones.
int count_tile(int level) { return level == 0 ? 2 * COUNT_TILE : COUNT_TILE; }
