// sat/lines.glsl — the map as parallel lines of words, cut into strips. Shared by reduce, scan and propagate.
//   For sums along rows, a line is a row and its words are 1 apart.
//   For sums along columns, a line is a column and its words are one row apart. One thread owns one strip of one line:
//
//            strip 0       strip 1       strip 2
//   line 0 │ • • • • → │ • • • • → │ • • • →          Neighbouring threads take neighbouring lines. Along columns
//   line 1 │ • • • • → │ • • • • → │ • • • →          they load neighbouring words; along rows each thread uses
//   line 2 │ • • • • → │ • • • • → │ • • • →          all words of its own cache lines.
//
//   A line that is not longer than a strip takes one pass, sat/propagate.comp. Software renderers, which have few
//   threads, sum WHOLE_LINES: rows by propagate, mostly four words at a time; columns by sat/columns.comp.
// Provides word[], strip_sum[], word_index(), strip_index(), strips().
// Python twin: reference.sat

#include "sat/word.glsl"

#ifndef THREADS
#define THREADS 64u
#endif

layout(local_size_x = THREADS) in;
layout(std430, binding = 0) buffer Words { WORD word[]; };
#ifdef WHOLE_LINES
layout(std430, binding = 0) buffer Fours { FOUR four[]; };  // the same words
#else
layout(std430, binding = 1) buffer StripSums { WORD strip_sum[]; };
#endif

uniform uint u_first;      // word of the buffer where the table begins
uniform uint u_lines;      // lines in a layer
uniform uint u_length;     // words in a line
uniform uint u_line_step;  // words from a line to the next
uniform uint u_word_step;  // words from a word to the next of its line
uniform uint u_strip;      // words of a strip

uint strips() { return (u_length + u_strip - 1u) / u_strip; }

uint word_index(uint line, uint i, uint layer) {
    return u_first + layer * u_lines * u_length + line * u_line_step + i * u_word_step;
}

uint strip_index(uint line, uint strip, uint layer) { return (layer * strips() + strip) * u_lines + line; }
