// generate/noise.glsl — gradient noise (Perlin 1985, fade of Perlin 2002), another field for each seed and layer.
//   n(p) = Σ fade(f) · g(c) · (p − c)   over the four corners c of p's cell, g a hashed unit vector
// Provides noise(), cell_hash(), finer().   Python twin: reference.noise

#include "generate/exact.glsl"

uniform uint u_seed;

uvec3 cell_hash(vec2 cell, uint layer) { return hash(uvec3(ivec2(cell), u_seed * 256u + layer)); }

// Unit vector within 45° of the x or the y axis, times ±d: (1, t) / sqrt(1 + t²) to 2 %, by a polynomial.
float corner(vec2 cell, vec2 d, uint layer) {
    uvec3 h = cell_hash(cell, layer);
    precise float t = signed_unit(h.x);
    precise float k = 1.0 - t * t * (0.5 - 0.2071068 * t * t);
    precise vec2 g = (h.y & 0x10000u) != 0u ? vec2(k * t, k) : vec2(k, k * t);
    float y = dot2(g, d);
    return (h.z & 0x10000u) != 0u ? -y : y;
}

float fade(float t) {
    precise float y = t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    return y;
}

// About -1 to 1; 0 at the corners of unit cells.
float noise(vec2 p, uint layer) {
    vec2 c = floor(p);
    precise vec2 f = p - c, g = f - 1.0;
    float north = blend(corner(c, f, layer), corner(c + vec2(1, 0), vec2(g.x, f.y), layer), fade(f.x));
    float south = blend(corner(c + vec2(0, 1), vec2(f.x, g.y), layer), corner(c + 1.0, g, layer), fade(f.x));
    precise float y = 1.5 * blend(north, south, fade(f.y));
    return y;
}

// The next octave: half the wavelength, rotated by atan(3/4) so that the lattices of octaves do not line up.
vec2 finer(vec2 p) {
    precise vec2 q = vec2(1.6 * p.x - 1.2 * p.y + 0.37, 1.2 * p.x + 1.6 * p.y + 0.71);
    return q;
}
