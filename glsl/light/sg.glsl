// light/sg.glsl — spherical Gaussians: lights, and the lobes of materials.
//   SG(ω) = a · e^(λ (ω·l − 1))       axis l, sharpness λ, amplitude a
//   ∫ SG  = 2π a (1 − e^(−2λ)) / λ
//   (Wang et al. 2009, "All-frequency rendering of dynamic, spatially-varying reflectance")
//   The product of two SGs is an SG: with s = λ1 l1 + λ2 l2,  λ = |s|, l = s/|s|, a = a1 a2 e^(|s| − λ1 − λ2).
//   |s| − λ1 − λ2 is computed as −2 λ1 λ2 (1 − l1·l2) / (|s| + λ1 + λ2): for sharp lobes the difference would cancel.
// Provides Lobe, sg_value(), sg_integral(), sg_product(), sg_inner_product().
// Python twins: reference.sg_integral, reference.sg_product

#define PI 3.14159265358979

struct Lobe {
    vec3 axis;
    float sharpness;
    vec3 amplitude;
};

float one_less_cosine(vec3 a, vec3 b) {  // 1 − a·b of unit vectors, without cancellation if they are close
    vec3 d = a - b;
    return 0.5 * dot(d, d);
}

vec3 sg_value(Lobe g, vec3 direction) { return g.amplitude * exp(-g.sharpness * one_less_cosine(direction, g.axis)); }

// 2π (1 − e^(−2λ)) / λ; 4π for λ = 0.
float sg_integral(float sharpness) {
    if (sharpness < 1e-3) return 4.0 * PI * (1.0 - sharpness);
    return 2.0 * PI * (1.0 - exp(-2.0 * sharpness)) / sharpness;
}

Lobe sg_product(Lobe a, Lobe b) {
    vec3 s = a.sharpness * a.axis + b.sharpness * b.axis;
    float sharpness = length(s), sum = a.sharpness + b.sharpness;
    float fall = 2.0 * a.sharpness * b.sharpness * one_less_cosine(a.axis, b.axis) / max(sharpness + sum, 1e-30);
    return Lobe(s / max(sharpness, 1e-30), sharpness, a.amplitude * b.amplitude * exp(-fall));
}

vec3 sg_inner_product(Lobe a, Lobe b) {
    Lobe product = sg_product(a, b);
    return product.amplitude * sg_integral(product.sharpness);
}
