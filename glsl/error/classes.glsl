// error/classes.glsl — error classes, a quarter of an octave each. For each class, tables count the tiles above its limit.
//   Class 0 has the largest limit; the limits go down to 2^-16 of the map's span.
// Provides class_limit_m(), tile_log2().   CLASSES, COUNT_TILE_LOG2: gpu/layout.py

float class_limit_m(int c) { return u_span_m * exp2(-0.25 * float(c) - 0.25); }

// log2 of a tile's side in nodes. Level 0, the cells of the map, has more nodes than all other levels together, and larger tiles.
int tile_log2(int level) { return level == 0 ? COUNT_TILE_LOG2 + 1 : COUNT_TILE_LOG2; }
