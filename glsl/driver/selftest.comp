// driver/selftest.comp — results of a driver, which terrain_gl/gpu/selftest.py compares with the CPU. Sums, products,
//   the rests of sums (mesh/pair.glsl) and sums of products differ if a driver does not round to nearest, or reorders
//   or fuses operations that are precise. Quotients, powers of two and square roots follow.

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Operands { vec4 operand[]; };
layout(std430, binding = 1) writeonly buffer Results { float result[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    vec4 o = operand[i];
    precise float sum = o.x + o.y, product = o.x * o.y, both = o.x * o.y + o.z;
    precise float of_y = sum - o.x, rest = (o.x - (sum - of_y)) + (o.y - of_y);
    result[7u * i] = sum;
    result[7u * i + 1u] = product;
    result[7u * i + 2u] = rest;
    result[7u * i + 3u] = both;
    result[7u * i + 4u] = o.x / o.w;
    result[7u * i + 5u] = exp2(-o.w);
    result[7u * i + 6u] = sqrt(o.w);
}
