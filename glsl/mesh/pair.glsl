// mesh/pair.glsl — numbers of about 48 bits: the sum of two floats, a rounded number x and its rest y.
//   Few cards compute doubles quickly, and compilers of some emulate them: 55,789 instructions for one shader.
//   sum_of() and product_of() are exact (Knuth 1969; Dekker 1971, "A floating-point technique for extending the
//   available precision"), if no compiler reorders or fuses their operations: they are `precise`, and the self-test
//   tries them. Of the results of the others, at most 2^-44 is lost: docs/precision.md, section 5.
// Provides sum_of(), product_of(), plus(), times(), over().

vec2 sum_of(float a, float b) {
    precise float sum = a + b;
    precise float of_b = sum - a;
    precise float rest = (a - (sum - of_b)) + (b - of_b);
    return vec2(sum, rest);
}

// The 12 highest bits of a number.
float high_half(float a) {
    precise float wide = 4097.0 * a;
    precise float high = wide - (wide - a);
    return high;
}

vec2 product_of(float a, float b) {
    precise float product = a * b;
    precise float a_high = high_half(a), b_high = high_half(b);
    precise float a_low = a - a_high, b_low = b - b_high;
    precise float rest = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low;
    return vec2(product, rest);
}

vec2 plus(vec2 a, vec2 b) {
    vec2 sum = sum_of(a.x, b.x);
    precise float rest = sum.y + (a.y + b.y);
    return sum_of(sum.x, rest);
}

vec2 times(vec2 a, vec2 b) {
    vec2 product = product_of(a.x, b.x);
    precise float rest = product.y + (a.x * b.y + a.y * b.x);
    return sum_of(product.x, rest);
}

// The quotient, by two steps of division with a remainder.
vec2 over(vec2 a, vec2 b) {
    float quotient = a.x / b.x;
    vec2 remainder = plus(a, times(vec2(-quotient, 0.0), b));
    return sum_of(quotient, remainder.x / b.x);
}
