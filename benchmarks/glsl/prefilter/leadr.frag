// prefilter/leadr.frag — mipmaps of slopes and of their products: a Gaussian of slopes for each footprint.
//   Dupuy et al. 2013, "Linear efficient antialiased displacement and reflectance mapping".
//   Slopes s have the mean μ and the covariance Σ.
//   A facet is weighted by its projected area w(s) = (o·n)/n_z = o_z − o_h·s
//   where this is positive (equation 6 of the paper; masking is the same factor for all facets and cancels):
//     diffuse    Σ w(s) max(n·l, 0) / Σ w(s), over the 7 × 7 points of a Gauss-Hermite rule instead of random points
//     specular   a lobe whose width is the mean width of the covariance plus the cover's own roughness

#include "../benchmarks/glsl/prefilter/frame.glsl"

const float AT[7] = float[7](-3.750439718, -2.366759411, -1.154405395, 0.0, 1.154405395, 2.366759411, 3.750439718);
const float WEIGHT[7] = float[7](5.48268856e-4, 3.07571240e-2, 0.240123179, 0.457142857, 0.240123179, 3.07571240e-2,
    5.48268856e-4);

struct Facets {
    vec3 normal[49];
    float weight[49];
};

Facets facets_of(Mips m, vec3 o) {
    Facets f;
    float a = sqrt(max(m.spread.x, 1e-12)), b = m.spread.z / a, c = sqrt(max(m.spread.y - b * b, 0.0));  // Cholesky
    float total = 1e-6;
    for (int i = 0; i < 49; i++) {
        vec2 x = vec2(AT[i % 7], AT[i / 7]), s = m.slope + vec2(a * x.x, b * x.x + c * x.y);
        f.normal[i] = normalize(vec3(-s, 1.0));
        f.weight[i] = WEIGHT[i % 7] * WEIGHT[i / 7] * max(o.z - dot(o.xy, s), 0.0);
        total += f.weight[i];
    }
    for (int i = 0; i < 49; i++) f.weight[i] /= total;
    return f;
}

Lit lit_by_baseline(Ground g) {
    Mips m = mips_over(g, 1.0);
    Facets f = facets_of(m, g.towards_eye);
    vec3 normal = vec3(0.0);
    float sun = 0.0;
    for (int i = 0; i < 49; i++) {
        normal += f.weight[i] * f.normal[i];
        sun += f.weight[i] * max(dot(f.normal[i], u_sun.axis), 0.0);
    }
    Lit l;
    l.lobe = merged_ground(g);
    l.lobe.normal = normal;
    float width = 1.0 / cover_sharpness(g) + 0.5 * (m.spread.x + m.spread.y);  // κ is one over the variance of slopes
    l.lobe.r = mean_length(1.0 / width) * normal_of(m.slope);
    l.unshadowed = sun;
    l.sun = m.sun * sun;
    add_sky(l, g.towards_eye, sky_seen(g));
    return l;
}

vec4 colour_of_pixel() { return shown(pixel_colour()); }

#include "shade/pixel.glsl"
