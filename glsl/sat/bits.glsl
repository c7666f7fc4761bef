// sat/bits.glsl — integers that wrap.
//   64 bits: uvec2, low half first.   32 bits, or four numbers of 8 bits side by side: uint.
//   All wrap modulo 2^bits, and differences of wrapped sums are exact while the true difference is below 2^bits.
// Provides add64(), sub64(), ATOMIC_ADD_64(), word_float().   Python twin: reference.sat

uvec2 add64(uvec2 a, uvec2 b) {
    uint carry;
    uint low = uaddCarry(a.x, b.x, carry);
    return uvec2(low, a.y + b.y + carry);
}

// Adds a uvec2 to two words in a buffer, low word first. If the low word wraps, the thread that sees it wrap carries.
#define ATOMIC_ADD_64(words, more) { \
    uvec2 more_ = more; \
    uint before_ = atomicAdd(words[0], more_.x); \
    atomicAdd(words[1], more_.y + (before_ + more_.x < before_ ? 1u : 0u)); \
}

uvec2 sub64(uvec2 a, uvec2 b) {
    uint borrow;
    uint low = usubBorrow(a.x, b.x, borrow);
    return uvec2(low, a.y - b.y - borrow);
}

float word_float(uint a) { return float(a); }
float word_float(uvec2 a) { return float(a.y) * 4294967296.0 + float(a.x); }
