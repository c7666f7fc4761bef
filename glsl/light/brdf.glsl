// light/brdf.glsl — the light that a footprint with merged normals reflects from one light.
//   Diffuse. The paper replaces max(ω·n, 0) by the lobe 1.170 e^(2.133 (ω·n − 1)) (B.3).
//   That lobe integrates to 3.398, not π, and lights ground that faces away. We use the merged vector r instead:
//   it is the mean of the normals n of a vMF distribution.
//   So the mean of max(l·n, 0) over the footprint can be computed directly. With c = r·l and a width w:
//
//       f(c) = max(c, 0) for |c| ≥ w,   (c + w)² / 4w between           ──╱  one normal: w = 0, f = the cosine
//       w² = 3 |r| (1 − |r|),  w = (1 + √(1 − 4|r|²/3)) / 2 for |r| < 3/4
//
//   w makes ∫ f dω = π for any |r|, so no light is lost or gained. f differs from the true mean by at most 0.01.
//   If the light is a lobe, it blurs the normals once more: the mean vectors of convolved lobes multiply.
//
//   Specular (B.1, B.2). The lobe of half-vectors becomes a lobe of incoming light around the reflected direction, with
//   sharpness κ/(4 |o·μ|) (Wang et al. 2009, section 4) and integral 1.
//   It is multiplied by Fresnel's factor (Schlick 1994).
// Provides cosine_mean(), reflection_lobe(), schlick(), sharpness_of_roughness().
// Python twins: reference.cosine_mean, reference.reflection_lobe

#include "light/vmf.glsl"

#define F0 0.03  // reflectance at normal incidence of rock, soil, snow, water: refractive indices from 1.3 to 1.5

// Mean of max(l·n, 0) over normals whose mean vector has length r; c is the component of that vector towards l.
float cosine_mean(float c, float r) {
    float w = r < 0.75 ? 0.5 + 0.5 * sqrt(1.0 - 4.0 / 3.0 * r * r) : sqrt(3.0 * r * max(1.0 - r, 0.0));
    if (abs(c) >= w) return max(c, 0.0);
    return (c + w) * (c + w) / (4.0 * w);
}

// Beckmann's α is roughness²; its lobe is as wide as a vMF of κ = 2/α² (Wang et al. 2009, equation 19).
float sharpness_of_roughness(float roughness) {
    float alpha = roughness * roughness;
    return min(2.0 / max(alpha * alpha, 1e-9), SHARPEST);
}

Lobe reflection_lobe(vec3 r, vec3 towards_eye) {
    Lobe half_vectors = vmf_lobe(r, vec3(1.0));
    float slant = max(abs(dot(towards_eye, half_vectors.axis)), 0.05);
    float k = half_vectors.sharpness / (4.0 * slant);
    return Lobe(reflect(-towards_eye, half_vectors.axis), k, vec3(1.0) / sg_integral(k));
}

// On rough ground, facets hide each other at low angles, so the ground mirrors less (after Lagarde 2011, "Adopting a
// physically based shading model").
float schlick(float cosine, float roughness) {
    float grazing = max((1.0 - roughness) * (1.0 - roughness), F0);
    float x = 1.0 - clamp(cosine, 0.0, 1.0), x_2 = x * x;
    return F0 + (grazing - F0) * x_2 * x_2 * x;
}
