// sat/word.glsl — the word of a table, for kernels that set BITS.
//   Kernels with WHOLE_LINES have uint64_t in place of uvec2. With FOURS, a word is a vector of four.
// Provides WORD, ADD(), SUB(), and FOUR for four words.   Python twin: reference.sat

#ifndef BITS
#define BITS 32
#endif
#if BITS == 64 && defined(WHOLE_LINES)
#extension GL_ARB_gpu_shader_int64 : require
#endif

#include "sat/bits.glsl"

#if BITS == 64 && defined(WHOLE_LINES)
#define WORD uint64_t
#define FOUR u64vec4
#define ADD(a, b) ((a) + (b))
#define SUB(a, b) ((a) - (b))
#elif BITS == 64
#define WORD uvec2
#define ADD add64
#define SUB sub64
#else
#define WORD uint
#define FOUR uvec4
#endif
#if BITS == 32
#define ADD add32
#define SUB sub32
#elif BITS == 8
#define ADD add8
#define SUB sub8
#endif
#ifdef FOURS
#undef WORD
#define WORD FOUR
#endif
