// mesh/patch.glsl — what a fragment knows of its patch, in four words. The patch's record is in mesh/shape.glsl.
// Provides Patch, words_of(), patch_of().

struct Patch {
    ivec2 low, high;   // posts of its north-west and south-east corners; the latter may lie beyond the map
    float step_log2;   // log2 of the posts between its vertices
    float bound_px;    // certified bound in its record; negative if it has none
};

uvec4 words_of(Patch p) {
    return uvec4(uint(p.low.x) | uint(p.low.y) << 16,
                 uint(p.high.x) | uint(p.high.y) << 16,
                 floatBitsToUint(p.step_log2),
                 packHalf2x16(vec2(0.0, min(p.bound_px, 6e4))));
}

Patch patch_of(uvec4 words) {
    return Patch(ivec2(words.x & 0xffffu, words.x >> 16),
                 ivec2(words.y & 0xffffu, words.y >> 16),
                 uintBitsToFloat(words.z), unpackHalf2x16(words.w).y);
}
