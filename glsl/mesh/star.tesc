// mesh/star.tesc — patches that lod/star.py looks at: 25 of 4 × 4 segments, and 25 of 8 × 8. Along west and south, and along north and east, they have
// 4, 8, 16, 32 or 64 segments, but no fewer than inside.

layout(vertices = 1) out;

flat in int v_number[];
patch out float v_patch;

void main() {
    int inside = v_number[0] < 25 ? 2 : 3, a = v_number[0] % 5 + 2, b = v_number[0] / 5 % 5 + 2;
    float along_a = exp2(float(max(a, inside))), along_b = exp2(float(max(b, inside))), segments = exp2(float(inside));
    v_patch = float(v_number[0]);
    gl_TessLevelOuter = float[4](along_a, along_b, along_b, along_a);
    gl_TessLevelInner = float[2](segments, segments);
}
