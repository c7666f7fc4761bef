// light/vmf.glsl — von Mises–Fisher lobes, vMF(ω; μ, κ) = κ / (4π sinh κ) · e^(κ μ·ω), and how many of them become one.
//   A lobe is its mean vector:   r = μ |r|,   |r| = coth κ − 1/κ                       (Xu et al. 2017, equation C.1)
//   Many lobes become one:       r = mean of their r  — the mixture's own mean vector, exactly         (equation C.3)
//   And back:                    κ ≈ (3|r| − |r|³) / (1 − |r|²)                                        (equation C.1)
//   C.1's κ is up to 5 % off the inverse of coth κ − 1/κ. Two steps of Newton leave nothing to speak of; beyond κ = 20 the
//   inverse is 1/(1 − |r|) as far as floats go. So equal lobes, merged, are what each of them was.
// Provides mean_length(), sharpness_of(), vmf_lobe().   Python twins: reference.mean_length, reference.sharpness_of_length

#include "light/sg.glsl"

#define SHARPEST 8192.0  // 16-bit vectors say no more

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

// The lobe of mean vector r, scaled by `weight`, as a Gaussian: its integral is the weight.
Lobe vmf_lobe(vec3 r, vec3 weight) {
    float length_ = length(r), k = sharpness_of(length_);
    return Lobe(length_ > 0.0 ? r / length_ : vec3(0.0, 0.0, 1.0), k, weight / sg_integral(k));
}
