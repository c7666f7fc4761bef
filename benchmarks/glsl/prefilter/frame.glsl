// prefilter/frame.glsl — code around other prefilters of normals, which we compare with ours:
//   footprint, albedo, sky, air and tone mapping are the same.
//   The normal, its spread and the sun's visibility come from mipmaps.
//   Mipmaps are square. A long footprint takes several samples along its length,
//   as graphics hardware does (McCormack et al. 1999, "Feline: fast elliptical lines for anisotropic texture mapping").
// The including file defines lit_by_baseline(). Provides Mips, mips_over(), sunlit().

#include "shade/samples.glsl"
#include "light/lit.glsl"
#include "light/shown.glsl"

layout(binding = 7) uniform sampler2D u_normals;
layout(binding = 8) uniform sampler2D u_slopes;
layout(binding = 9) uniform sampler2D u_products;

#define MOST_LOOKS 8

struct Mips {
    vec3 normal;   // mean of unit normals
    float sun;     // mean visible share of the sun
    vec2 slope;    // mean slope; then the covariance: xx, yy, xy
    vec3 spread;
};

// The longer half axis of a footprint's ellipse, whose covariance is u uᵀ + v vᵀ, in posts.
vec2 long_axis(vec2 u, vec2 v) {
    float a = u.x * u.x + v.x * v.x, d = u.y * u.y + v.y * v.y, b = u.x * u.y + v.x * v.y;
    float mean = 0.5 * (a + d), apart = sqrt(0.25 * (a - d) * (a - d) + b * b);
    vec2 e = abs(b) > 1e-6 * mean ? normalize(vec2(b, mean + apart - a)) : (a > d ? vec2(1.0, 0.0) : vec2(0.0, 1.0));
    return e * min(sqrt(mean + apart), largest_box_posts());
}

Mips mips_over(Ground g, float scale) {
    vec2 along = long_axis(g.u, g.v);
    float long_ = length(along), wide = max(g.extent.x * g.extent.y / max(long_, 1e-6), 1e-6);
    wide = min(wide, long_);
    int looks = clamp(int(ceil(long_ / wide)), 1, MOST_LOOKS);
    float level = log2(max(scale * max(wide, long_ / float(looks)), 1.0));
    vec4 n = vec4(0.0), s = vec4(0.0);
    float xy = 0.0;
    for (int i = 0; i < looks; i++) {
        vec2 at = (g.post + along * ((float(i) + 0.5) / float(looks) - 0.5)) / vec2(u_last_post);
        n += textureLod(u_normals, at, level) / float(looks);
        s += textureLod(u_slopes, at, level) / float(looks);
        xy += textureLod(u_products, at, level).x / float(looks);
    }
    vec3 spread = vec3(max(s.zw - s.xy * s.xy, 0.0), xy - s.x * s.y);
    return Mips(n.xyz, n.w, s.xy, spread);
}

Lit lit_by_baseline(Ground g);

// The light of sun and sky on a footprint with a single normal.
Lit lit_as_one(Ground g, vec3 normal, float sharpness, float sun_seen) {
    Lit l;
    l.lobe = merged_ground(g);
    l.lobe.normal = normal;
    l.lobe.r = mean_length(sharpness) * normal;
    l.unshadowed = max(dot(normal, u_sun.axis), 0.0);
    l.sun = sun_seen * l.unshadowed;
    add_sky(l, g.towards_eye, sky_seen(g));
    return l;
}

// Roughness of the cover alone, as the sharpness of a lobe of half-vectors.
float cover_sharpness(Ground g) { return sharpness_of_roughness(material_of(g.post, g.extent, g.fine).roughness); }

vec3 ground_colour(Ground g, int sample_) {
    return land_colour(g, outgoing_light(g.towards_eye, lit_by_baseline(g)), g.distance_m);
}
