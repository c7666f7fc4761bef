// sat/lines.glsl — the map as parallel lines of words, cut into strips. Shared by reduce, scan and propagate.
//   For sums along rows, a line is a row and its words are 1 apart. For sums along columns, a line is a column and its words
//   are one row apart. One thread owns one strip of one line:
//
//            strip 0       strip 1       strip 2
//   line 0 │ • • • • → │ • • • • → │ • • • →          Neighbouring threads take neighbouring lines. Along columns
//   line 1 │ • • • • → │ • • • • → │ • • • →          they load neighbouring words; along rows each thread uses
//   line 2 │ • • • • → │ • • • • → │ • • • →          all words of its own cache lines.
//
//   Where a strip is as long as a line, rows and columns take one pass each, sat/propagate.comp.
//
// Provides word[], strip_sum[], word_index(), strip_index(), strips().
// Python twin: reference.sat

#include "sat/word.glsl"

#ifndef STRIP
#define STRIP 64
#endif

layout(local_size_x = 64) in;
layout(std430, binding = 0) buffer Words { WORD word[]; };
layout(std430, binding = 1) buffer StripSums { WORD strip_sum[]; };

uniform uint u_first;      // word of the buffer where the table begins
uniform uint u_lines;      // lines in a layer
uniform uint u_length;     // words in a line
uniform uint u_line_step;  // words from a line to the next
uniform uint u_word_step;  // words from a word to the next of its line

uint strips() { return (u_length + STRIP - 1u) / STRIP; }

uint word_index(uint line, uint i, uint layer) {
    return u_first + layer * u_lines * u_length + line * u_line_step + i * u_word_step;
}

uint strip_index(uint line, uint strip, uint layer) { return (layer * strips() + strip) * u_lines + line; }
