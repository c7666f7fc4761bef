// prefilter/printed.glsl — diffuse light as the supplement of Li et al. 2021 prints it: B.3 and B.4, merged by C.1 to C.4.
//   r   = |r| n with (3 |r| − |r|³) / (1 − |r|²) = κ;  r_M = mean of r;  ρ_n = weight · vMF(ω; r_M)
// Provides printed_diffuse(), cubic_length(), cubic_sharpness().
// Python twins: reference.printed_diffuse, reference.cubic_length, reference.cubic_sharpness

#include "light/brdf.glsl"

float cubic_sharpness(float r) { return r * (3.0 - r * r) / (1.0 - r * r); }

// The root of r³ − κ r² − 3 r + κ = 0 between 0 and 1, by Newton's method.
float cubic_length(float sharpness) {
    float k = sharpness, r = mean_length(k);
    for (int i = 0; i < 3; i++) r -= (r * (r * (r - k) - 3.0) + k) / (r * (3.0 * r - 2.0 * k) - 3.0);
    return r;
}

#define DIFFUSE_SHARPNESS 2.133
#define DIFFUSE_PEAK 1.170

// ∫ SG(ω) ρ_n(ω) dω / π for white ground with the mean normal n.
vec3 printed_diffuse(Lobe light, vec3 normal) {
    vec3 r = cubic_length(DIFFUSE_SHARPNESS) * normal;
    float length_ = length(r), k = cubic_sharpness(length_);
    float weight = DIFFUSE_PEAK * sg_integral(DIFFUSE_SHARPNESS);
    Lobe merged = Lobe(length_ > 0.0 ? r / length_ : vec3(0.0, 0.0, 1.0), k, vec3(weight / sg_integral(k)));
    return sg_inner_product(light, merged) / PI;
}
