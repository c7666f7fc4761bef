// mesh/star.tesc — patches that lod/star.py looks at: 25 of 4 × 4 segments, and 25 of 8 × 8. Along west and south, and along north and east, they have
// 4, 8, 16, 32 or 64 segments, but no fewer than inside.

layout(vertices = 1) out;

void main() {
    int inside = gl_PrimitiveID < 25 ? 2 : 3;
    ivec2 along = max(ivec2(gl_PrimitiveID % 5, gl_PrimitiveID / 5 % 5) + 2, inside);
    gl_TessLevelOuter = float[4](1 << along.x, 1 << along.y, 1 << along.y, 1 << along.x);
    gl_TessLevelInner = float[2](1 << inside, 1 << inside);
}
