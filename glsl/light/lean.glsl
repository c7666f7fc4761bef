// light/lean.glsl — facets that face the eye cover more of the pixel than others.
//   A facet with slope s and normal n has the weight w(s) = max(o·n, 0) / n_z = max(o_z − o_h·s, 0)
//   in the picture; o is the direction to the eye, o_h its horizontal part (Dupuy et al. 2013, equation 6). Let slopes
//   be Gaussian with mean s̄ and variance σ² along each axis. Φ and φ are the normal distribution and its density.
//   With ς = σ |o_h| and t = (o_z − o_h·s̄) / ς, the best linear approximation of w is, by Stein's lemma:
//     w(s) ≈ W (1 − lean · (s − s̄)),    lean = o_h Φ(t) / W,    W = ς (t Φ(t) + φ(t))
//   So a mean over the picture is the mean over the map minus lean · the covariance with the slope.
//   Covariances are linear, and tables hold them.   σ² follows from the length of the mean normal.
// Provides normal_share(), lean_of().   Python twin: reference.lean

#include "light/lobes.glsl"

float slope_variance(vec3 normal) {
    float length_2 = clamp(dot(normal, normal), 1e-3, 1.0);
    float steep = dot(normal.xy, normal.xy) / max(normal.z * normal.z, 1e-3);
    return 0.5 * (1.0 / length_2 - 1.0) * (1.0 + steep);
}

float normal_share(float t) { return 0.5 + 0.5 * tanh(0.7978845608 * t * (1.0 + 0.044715 * t * t)); }  // Φ

vec2 lean_of(vec3 normal, vec3 o) {
    vec2 slope = -normal.xy / max(normal.z, 0.03);
    float spread = sqrt(slope_variance(normal)) * length(o.xy), facing = o.z - dot(o.xy, slope);
    if (spread < 0.01 * facing) return o.xy / facing;  // all facets are seen
    float t = clamp(facing / max(spread, 1e-4), -1.0, 6.0), share = normal_share(t);
    return o.xy * share / max(spread * (t * share + 0.39894228 * exp(-0.5 * t * t)), 1e-4);
}
