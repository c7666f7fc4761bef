// light/lit.glsl — outgoing radiance of a footprint (A.6): for each light, its lobe × the footprint's merged lobe × the
// visible fraction of the light.
//   Near the eye a footprint is one place, with its own normal and cover.
//   The sun's shadows have edges, so its visibility is looked up at the place of each sample.
//   Far away, means come from tables. In between, the two are blended.
// Provides Lit, merged_ground(), lit_ground(), direct_light(), outgoing_light().

#include "shade/footprint.glsl"
#include "light/dome.glsl"  // u_dome before u_lobe_sums: see gl.texel_texture
#include "light/merged.glsl"
#include "shade/grain.glsl"
#include "light/lean.glsl"
#include "horizon/visible.glsl"

struct Lit {
    Merged lobe;
    float unshadowed;  // mean of ⟨n, sun⟩ over the footprint
    float sun;         // mean of V · ⟨n, sun⟩
    vec3 ambient;      // diffuse radiance of white ground under the sky and the surrounding land
    vec3 mirrored;     // specular radiance under the sky and the surrounding land
    float sky;         // mean visible fraction of the sky's lobes
};

Merged blended(Merged a, Merged b, float t) {
    return Merged(mix(a.normal, b.normal, t), mix(a.r, b.r, t), mix(a.albedo, b.albedo, t));
}

Merged merged_ground(Ground g) {
    float far = HAS_SUMS ? farness_from(LOBES_FROM, g.extent) : 0.0;
    Merged near_, far_;
    if (far < 1.0) {
        Material material = material_of(g.post, g.extent, g.fine);
        Grain grain = grain_of(g.post, g.extent, grain_strength(g.post, length(g.fine.slope), material.albedo));
        material.albedo *= 1.0 + grain.speck;
        near_ = merged_at(normal_of(g.fine.slope + grain.slope), material);
    }
    if (HAS_SUMS && MAY_BE_FAR && far > 0.0) far_ = merged_over(g.post, g.extent);
    return far == 0.0 ? near_ : far == 1.0 ? far_ : blended(near_, far_, far);
}

float cosine_of(Merged m, Light l) {
    return cosine_mean(l.mean_length * dot(m.normal, l.axis), min(length(m.normal), 1.0) * l.mean_length);
}

// Share of a lobe above a plane. We assume that the lobe's component along the normal is Gaussian.
float share_above(Lobe lobe, vec3 normal) {
    float k = lobe.sharpness, A = mean_length(k), c = dot(lobe.axis, normal);
    float aside = A / max(k, 1e-3), along = max(1.0 - 2.0 * aside - A * A, 0.0);
    return normal_share(A * c * inversesqrt(max(mix(aside, along, c * c), 1e-6)));
}

// The visible share of each lobe of the sky, three a column.
mat4x3 sky_seen(Ground g) {
    if (!HAS_SUMS || !MAY_BE_FAR) return sky_visible_near(g.post, g.extent);
    mat4x3 visible;
    for (int i = 0; i < SKY_LOBES; i++) visible[i / 3][i % 3] = sky_visible(i, g.post, g.extent);
    return visible;
}

// Add the sky's light: diffuse on white ground, and mirrored by rough ground.
// The part of the mirrored lobe that is below the horizon, or below the ground's plane, sees land.
void add_sky(inout Lit l, vec3 towards_eye, mat4x3 visible) {
    Lobe mirror = reflection_lobe(l.lobe.r, towards_eye);
    float all = 0.0, above = share_above(mirror, normalize(l.lobe.normal));
    l.mirrored = u_around * (1.0 - share_above(mirror, vec3(0.0, 0.0, 1.0)));
    l.ambient = vec3(0.0);
    l.sky = 0.0;
    for (int i = 0; i < SKY_LOBES; i++) {
        Light lobe = u_sky[i];
        float seen = visible[i / 3][i % 3], width = lobe.integral * lobe.axis.z;
        vec3 light = sky_through(lobe, seen);
        l.ambient += light * (lobe.integral / PI * cosine_of(l.lobe, lobe));
        l.mirrored += sg_inner_product(Lobe(lobe.axis, lobe.sharpness, light), mirror);
        l.sky += width * seen;
        all += width;
    }
    l.sky /= all;
    l.mirrored = mix(u_around, l.mirrored, above);
    l.ambient += u_around * (0.5 - 0.5 * l.lobe.normal.z);
}

// V ⟨n, sun⟩ of one place, and ⟨n, sun⟩; V is the visible share of the sun. A store has no means of sunlight: there, a
// large footprint has its mean slope.
vec2 sun_at(Ground g, vec2 post, float grained) {
    vec2 extent = PART * g.extent;
    vec2 slope = mix(relief_of(post, vec2(0.0)).slope, g.fine.slope, HAS_SUMS ? 0.0 : farness(g.extent));
    slope += grain_of(post, extent, grained).slope;
    return max(dot(normal_of(slope), u_sun.axis), 0.0) * vec2(sun_share(post, extent), 1.0);
}

// Adds the sunlight: its mean over the parts of the footprint. Each part covers an equal part of the picture.
// Near the eye, a part is the place that one sample sees.
void add_sun(inout Lit l, Ground g, vec2 lean) {
    float far = HAS_SUMS ? farness(g.extent) : 0.0;
    vec2 near_ = vec2(0.0), far_ = vec2(0.0, cosine_of(l.lobe, u_sun));  // x: with shadows, y: without
    float grained = far < 1.0 ? grain_strength(g.post, length(g.fine.slope), l.lobe.albedo) : 0.0;
    float weight = 1.0 / float(bitCount(g.samples));
    int left = g.samples;
    do {  // compilers unroll a loop over all samples; this loop they compile only once
        vec2 part = part_of(g, findLSB(left));
        if (far < 1.0) near_ += weight * sun_at(g, part, grained);
        if (HAS_SUMS && MAY_BE_FAR && far > 0.0) far_.x += weight * sun_over(part, PART * g.extent, lean);
        left &= left - 1;
    } while (left != 0);
    vec2 sun = mix(near_, far_, far);
    l.sun = sun.x;
    l.unshadowed = sun.y;
}

Lit lit_ground(Ground g) {
    Lit l;
    l.lobe = merged_ground(g);
    add_sun(l, g, lean_of(l.lobe.normal, g.towards_eye));
    add_sky(l, g.towards_eye, sky_seen(g));
    return l;
}

// Radiance of white ground in the sun.
vec3 direct_light(Lit l) { return u_sun.amplitude * (u_sun.integral / PI * l.sun); }

// Sunlight that the ground mirrors to the eye (B.1): the lobe of half-vectors, at the half-vector h of the sun and the
// eye, times dω_h / dω_i = 1 / (4 o·h).
// A warped lobe, as in reflection_lobe(), would be too wide here.
vec3 mirrored_sun(vec3 r, vec3 towards_eye) {
    vec3 h = normalize(towards_eye + u_sun.axis + vec3(0.0, 0.0, 1e-6));
    return u_sun.amplitude * u_sun.integral * sg_value(vmf_lobe(r, vec3(1.0)), h)
        / (4.0 * max(dot(h, towards_eye), 0.05));
}

vec3 outgoing_light(vec3 towards_eye, Lit l) {
    float sharpness = sharpness_of(length(l.lobe.r)), roughness = sqrt(sqrt(min(2.0 / sharpness, 1.0)));
    float mirrored = schlick(dot(normalize(l.lobe.r), towards_eye), roughness);
    float sun_seen = l.unshadowed > 1e-3 ? min(l.sun / l.unshadowed, 1.0) : 0.0;
    vec3 specular = mirrored_sun(l.lobe.r, towards_eye) * sun_seen + l.mirrored;
    return mix(l.lobe.albedo * (direct_light(l) + l.ambient), specular, mirrored);
}
