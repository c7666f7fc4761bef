// sat/word.glsl — the word of a table, for kernels that set BITS: 64, or 32 for one number or four of 8 bits in a word.
//   Kernels for software renderers (WHOLE_LINES: sat/lines.glsl) have uint64_t in place of uvec2, which adds in one
//   instruction. With FOURS, a word is a vector of four.
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
#define ADD(a, b) add_apart(a, b, u_low_bits)
#define SUB(a, b) sub_apart(a, b, u_low_bits)
uniform uint u_low_bits;  // all bits of a word except the highest of each number in it
#endif

#ifdef FOURS
#undef WORD
#define WORD FOUR
#endif

#if BITS == 32
// The numbers of a word, one or four: `low` has all bits except the highest of each number. The low bits are added
// without a carry out; the highest is an exclusive or (Warren 2002, "Hacker's delight", section 2-18).
WORD add_apart(WORD a, WORD b, uint low) { return ((a & low) + (b & low)) ^ ((a ^ b) & ~low); }
WORD sub_apart(WORD a, WORD b, uint low) { return ((a | ~low) - (b & low)) ^ ((a ^ ~b) & ~low); }
#endif
