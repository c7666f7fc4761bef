// sat/edit.glsl — an edit of a table: a rectangle gets new values, which differ from old ones by d. Sums are linear:
//     S_new(x, y) = S_old(x, y) + D(x, y),   D = the table of d, constant to the right of and below the rectangle.
//   All sums are exact modulo 2^bits, so the result equals a rebuilt table, bit for bit.
// Python twin: reference.sat

#include "sat/word.glsl"
#include "sat/box.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 0) buffer Words { WORD word[]; };
layout(std430, binding = 1) buffer Edits { WORD edit[]; };

uniform uint u_first;       // word of the buffer where the table begins
uniform ivec2 u_size;       // of the table
uniform ivec2 u_edit_at;    // corner of the rectangle
uniform ivec2 u_edit_size;  // of the rectangle
