// prefilter/printed.frag — the shading of the supplement of Li et al. 2021, as printed, or a step towards it.
//   L   = Σ over lights l of  V_l · ∫ SG_l(ω) ρ_n(ω) dω                                        (A.5, A.6)
//   V_l = mean over the footprint of ∫ SG_l V dω / ∫ SG_l dω, without a cosine, above the horizontal              (A.5)
//   ρ_n = mean of 1.170 e^(2.133 (ω·n − 1)), the cosine as a lobe: κ = 2.133, weight 3.398    (B.3, B.4)
//   B.3 as printed lacks the factor 1/π of the diffuse BRDF. We include it; else the ground would be π times as bright.
//   Two steps from our shading to the printed shading; the second includes the first:
//     PRINTED 1   A.5: visibility is separate from the cosine, for the sun and for the sky
//     PRINTED 2   B.3, B.4, C.1 to C.4: the lobe of κ = 2.133 instead of the closed mean of the cosine
//   Specular light is ours, with the visibility of these steps.

#include "shade/samples.glsl"
#include "light/lit.glsl"
#include "../benchmarks/glsl/prefilter/printed.glsl"

#ifndef PRINTED
#define PRINTED 0
#endif
#include "light/shown.glsl"

vec3 diffuse_from(Light light, vec3 amplitude, Merged m) {
    if (PRINTED >= 2) return printed_diffuse(Lobe(light.axis, light.sharpness, amplitude), m.normal);
    return amplitude * (light.integral / PI * cosine_of(m, light));
}

// Mean visible share of the sun's disc over the footprint.
float sun_visible(Ground g) {
    float far = farness(g.extent), share = 0.0;
    for (int left = g.samples; left != 0; left &= left - 1) {
        vec2 part = part_of(g, findLSB(left));
        float near_ = far < 1.0 ? sun_share(part, PART * g.extent) : 0.0;
        float far_ = MAY_BE_FAR && far > 0.0 ? sun_over(part, PART * g.extent, vec2(0.0)) : 0.0;
        share += mix(near_, far_, far) / float(bitCount(g.samples));
    }
    return share;
}

Lit lit_as_printed(Ground g) {
    Lit l;
    l.lobe = merged_ground(g);
    l.unshadowed = diffuse_from(u_sun, vec3(PI / u_sun.integral), l.lobe).x;
    l.sun = sun_visible(g) * l.unshadowed;
    add_sky(l, g.towards_eye, sky_seen(g));
    if (PRINTED < 2) return l;
    l.ambient = u_around * (0.5 - 0.5 * l.lobe.normal.z);
    for (int i = 0; i < SKY_LOBES; i++) {
        float visible = sky_visible(i, g.post, g.extent);
        l.ambient += diffuse_from(u_sky[i], sky_through(u_sky[i], visible), l.lobe);
    }
    return l;
}

vec3 ground_colour(Ground g, int sample_) {
    return land_colour(g, outgoing_light(g.towards_eye, lit_as_printed(g)), g.distance_m);
}

vec4 colour_of_pixel() { return shown(pixel_colour()); }

#include "shade/pixel.glsl"
