// truth/random.glsl — points that fill a square evenly, a different set for every pixel;
//   and directions from them.
// Provides random_unit(), point_of(), around(), in_disc(), cosine_weighted(), vmf_weighted().

#ifndef PI
#define PI 3.14159265358979
#endif

uint random_state;

float random_unit() {  // PCG (O'Neill 2014; Jarzynski and Olano 2020)
    random_state = random_state * 747796405u + 2891336453u;
    uint word = ((random_state >> ((random_state >> 28) + 4u)) ^ random_state) * 277803737u;
    return float((word >> 22 ^ word) >> 8) / 16777216.0;
}

void seed_random(ivec2 pixel, int run) {
    random_state = uint(pixel.x) * 0x9e3779b1u ^ uint(pixel.y) * 0x85ebca77u ^ uint(run) * 0xc2b2ae3du;
    random_unit();
    random_unit();
}

// Point i of n of the R2 sequence, shifted (Roberts 2018).
vec2 point_of(int i, vec2 shift) { return fract(shift + float(i) * vec2(0.7548776662, 0.5698402910)); }

// From a frame around the z axis to one around an axis (Duff et al. 2017, "Building an orthonormal basis, revisited").
vec3 around(vec3 axis, vec3 v) {
    float s = axis.z >= 0.0 ? 1.0 : -1.0, a = -1.0 / (s + axis.z), b = axis.x * axis.y * a;
    vec3 x = vec3(1.0 + s * axis.x * axis.x * a, s * b, -s * axis.x), y = vec3(b, s + axis.y * axis.y * a, -axis.y);
    return v.x * x + v.y * y + v.z * axis;
}

vec3 cosine_weighted(vec3 axis, vec2 u) {
    float r = sqrt(u.x), angle = 2.0 * PI * u.y;
    return around(axis, vec3(r * cos(angle), r * sin(angle), sqrt(1.0 - u.x)));
}

vec3 in_disc(vec3 axis, float radius, vec2 u) {
    float r = sin(radius) * sqrt(u.x), angle = 2.0 * PI * u.y;
    return around(axis, vec3(r * cos(angle), r * sin(angle), sqrt(1.0 - r * r)));
}

// With the density k / (4π sinh k) e^(k cos)
// (Jakob 2012, "Numerically stable sampling of the von Mises-Fisher distribution").
vec3 vmf_weighted(vec3 axis, float k, vec2 u) {
    float w = 1.0 + log(u.x + (1.0 - u.x) * exp(-2.0 * k)) / k, r = sqrt(max(1.0 - w * w, 0.0)), angle = 2.0 * PI * u.y;
    return around(axis, vec3(r * cos(angle), r * sin(angle), w));
}
