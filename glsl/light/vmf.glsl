// light/vmf.glsl — von Mises–Fisher lobes, vMF(ω; μ, κ) = κ / (4π sinh κ) · e^(κ μ·ω), and how to merge many into one.
//   A lobe has a mean vector:    r = μ |r|,   |r| = coth κ − 1/κ                       (Xu et al. 2017, equation C.1)
//   Many lobes become one:       r = mean of their r  — exactly the mean vector of the mixture         (equation C.3)
//   Its sharpness:               κ ≈ (3|r| − |r|³) / (1 − |r|²)                                        (equation C.1)
//   C.1's κ differs by up to 5 % from the exact inverse of coth κ − 1/κ. Two Newton steps remove that error;
//   above κ = 20 the inverse is 1/(1 − |r|) in float precision. So merging equal lobes gives the same lobe again.
// Provides mean_length(), sharpness_of(), vmf_lobe().
// Python twins: reference.mean_length, reference.sharpness_of_length

#include "light/sg.glsl"

#define SHARPEST 8192.0  // vectors of 16 bits cannot represent sharper lobes

float mean_length(float sharpness) {
    if (sharpness < 0.1) return sharpness * (1.0 / 3.0 - sharpness * sharpness / 45.0);
    float e = exp(-2.0 * sharpness);
    return (1.0 + e) / (1.0 - e) - 1.0 / sharpness;
}

float sharpness_of(float length_) {
    float r = clamp(length_, 0.0, 1.0 - 1.0 / SHARPEST);
    if (r > 0.95) return 1.0 / (1.0 - r);
    float k = r * (3.0 - r * r) / (1.0 - r * r);
    if (k < 0.1) return k;
    for (int i = 0; i < 2; i++) {
        float A = mean_length(k);
        k -= (A - r) / (1.0 - A * A - 2.0 * A / k);
    }
    return k;
}

// The lobe with mean vector r as a Gaussian whose integral is `weight`.
Lobe vmf_lobe(vec3 r, vec3 weight) {
    float length_ = length(r), k = sharpness_of(length_);
    return Lobe(length_ > 0.0 ? r / length_ : vec3(0.0, 0.0, 1.0), k, weight / sg_integral(k));
}
