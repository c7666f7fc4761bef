// driver/selftest.comp — results of a driver, which terrain_gl/gpu/selftest.py compares with the CPU. Sums, products
//   and sums of products differ if a driver does not round to nearest, or fuses operations that are precise.
//   Quotients, powers of two and square roots follow.

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Operands { vec4 operand[]; };
layout(std430, binding = 1) writeonly buffer Results { float result[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    vec4 o = operand[i];
    precise float sum = o.x + o.y, product = o.x * o.y, both = o.x * o.y + o.z;
    result[6u * i] = sum;
    result[6u * i + 1u] = product;
    result[6u * i + 2u] = both;
    result[6u * i + 3u] = o.x / o.w;
    result[6u * i + 4u] = exp2(-o.w);
    result[6u * i + 5u] = sqrt(o.w);
}
