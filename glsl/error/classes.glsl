// error/classes.glsl — error classes. For each class, tables count the tiles whose error is above its limit.
//   Class 0 has the largest limit. Limits go down from the span. Most decisions are about errors below the width of 16 cells of the
//   map, or below a quarter of the span if that is less. There, NARROW_CLASSES classes are an eighth of an octave each. The WIDE_CLASSES above reach up
//   to the span, and are wider; so are the last ones, below.
//
//        span                    u_class_octaves.x                                               octaves below the span
//        |  0  |  1  |  2  |  3  |4|5|6| ... |59|      60      |      61      |      62      |      63      |   class
//
// Provides class_limit_m(), class_of_octave(), tile_log2().
// Sizes come from gpu/layout.py.   Python twin: reference.class_limits

float class_limit_m(int c) {
    float above = min(float(c) + 1.0, float(WIDE_CLASSES)), rest = float(c) + 1.0 - above, narrow = min(rest, float(NARROW_CLASSES));
    vec3 octaves = vec3(above, narrow, rest - narrow) * u_class_octaves.yzw;
    return u_span_m * exp2(-(octaves.x + octaves.y + octaves.z));
}

// The inverse: the number, with a fraction, of the class whose limit is so many octaves below the span.
float class_of_octave(float octave) {
    float above = min(octave, u_class_octaves.x), rest = octave - above, narrow = min(rest, float(NARROW_CLASSES) * u_class_octaves.z);
    vec3 k = vec3(above, narrow, rest - narrow) / u_class_octaves.yzw;
    return k.x + k.y + k.z - 1.0;
}

// log2 of a tile's side in nodes. Level 0, the cells of the map, has more nodes than all other levels together, and larger tiles.
int tile_log2(int level) { return level == 0 ? COUNT_TILE_LOG2 + 1 : COUNT_TILE_LOG2; }
