// generate/exact.glsl — arithmetic that gives the same bits on every driver.
//   In GLSL 4.30 (section 4.5.1) addition, subtraction, multiplication, comparison and floor() of floats follow
//   IEEE 754. Division, square roots and functions like dot() may differ in their last bits, so we do not use them.
//   `precise` prevents a product and a sum from becoming one operation. Every function returns a precise variable.
// Provides blend(), dot2(), smooth_step(), inverse_sqrt(), soft_abs(), soft_min(), hash(), signed_unit().
// Python twins: reference.generate.inverse_sqrt, reference.pcg3d

float blend(float a, float b, float t) {
    precise float y = a + t * (b - a);
    return y;
}

float dot2(vec2 a, vec2 b) {
    precise float y = a.x * b.x + a.y * b.y;
    return y;
}

// 0 below `low`, 1 above low + 1 / steepness, smooth in between.
float smooth_step(float low, float steepness, float x) {
    precise float t = min(max((x - low) * steepness, 0.0), 1.0);
    precise float y = t * t * (3.0 - 2.0 * t);
    return y;
}

// 1 / sqrt(x) by Newton's method, from a guess that halves the exponent (Lomont 2003).
float inverse_sqrt(float x) {
    precise float y = uintBitsToFloat(0x5f375a86u - (floatBitsToUint(x) >> 1));
    precise float half_x = 0.5 * x;
    for (int i = 0; i < 3; i++) y = y * (1.5 - half_x * y * y);
    return y;
}

// A smooth |x|: x² / softness near 0, and |x| far from 0.
float soft_abs(float x, float softness) {
    precise float square = x * x;
    precise float bounded = square + softness * softness;
    precise float y = square * inverse_sqrt(bounded);
    return y;
}

// The smaller of two numbers; where they differ by less than 0.1, a smooth transition, which is a little lower.
float soft_min(float a, float b) {
    precise float near = max(0.1 - abs(a - b), 0.0);
    precise float y = min(a, b) - 2.5 * near * near;
    return y;
}

// Hash of three 32-bit numbers to three others (pcg3d of Jarzynski and Olano 2020, listing 2).
uvec3 hash(uvec3 v) {
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v ^= v >> 16u;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    return v;
}

// A number from -1 to 1, from the 24 highest bits.
float signed_unit(uint bits) {
    precise float y = float(bits >> 8) * (1.0 / 8388608.0) - 1.0;
    return y;
}
