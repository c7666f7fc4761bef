// truth/light.frag — outgoing radiance by brute force (A.2) of the one place that this pixel sees.
//   Many pixels are averaged to one; nothing is prefiltered, fitted, or read from a table.
//   Sun: a disc of its angular size. Sky: the dome, sampled in proportion to the cosine.
//   Visibility: rays through the true ground.
//   Material: Lambert's cosine, and the half-vector lobe that B.1 merges, sampled directly.
// Where land hides the sky, the land has the same radiance as for the fitted lobes.

#include "shade/footprint.glsl"
#include "light/lobes.glsl"
#include "light/air.glsl"
#include "../benchmarks/glsl/truth/ground.glsl"
#include "../benchmarks/glsl/truth/random.glsl"

uniform int u_rays;        // rays to the sky for diffuse light; half as many for mirrored light
uniform int u_run;
uniform float u_sun_disc;  // angular radius of the sun, radians
uniform vec3 u_hidden;     // radiance of land in front of the sky

out vec4 out_colour;

struct Place {
    vec2 post;
    float height_m;
    vec3 normal, towards_eye;
    Material material;
    float distance_m;
};

Place place_at(vec2 post) {
    float h = ground_m(post);
    vec2 slope = slope_of_cells(post);
    vec3 from_eye = place_from_eye_m(post, h);
    float distance_m = max(length(from_eye), 1e-6);
    return Place(post, h, normal_of(slope), -from_eye / distance_m, material_of(post, vec2(0.2), Relief(h, slope)),
        distance_m);
}

vec3 radiance_from(Place p, vec3 direction) {
    return sees(p.post, p.height_m, direction) ? sky_light(direction) : u_hidden;
}

vec3 sun_irradiance_at(Place p) {  // on ground that faces the sun
    vec3 towards = in_disc(u_sun.axis, u_sun_disc, vec2(random_unit(), random_unit()));
    bool seen = dot(p.normal, towards) > 0.0 && sees(p.post, p.height_m, towards);
    return seen ? u_sun.amplitude * u_sun.integral : vec3(0.0);
}

vec3 sky_radiance(Place p) {  // of white ground under the sky
    vec3 sum = vec3(0.0);
    vec2 shift = vec2(random_unit(), random_unit());
    for (int i = 0; i < u_rays; i++) sum += radiance_from(p, cosine_weighted(p.normal, point_of(i, shift)));
    return sum / float(u_rays);
}

vec3 mirrored_radiance(Place p, vec3 sun, float k) {
    vec3 h = normalize(p.towards_eye + u_sun.axis), sum = vec3(0.0);
    float density = k / (2.0 * PI * (1.0 - exp(-2.0 * k))) * exp(k * (dot(h, p.normal) - 1.0))
        / (4.0 * max(dot(h, p.towards_eye), 0.05));
    vec2 shift = vec2(random_unit(), random_unit());
    for (int i = 0; i < u_rays / 2; i++) {
        vec3 half_ = vmf_weighted(p.normal, k, point_of(i, shift)), direction = reflect(-p.towards_eye, half_);
        sum += dot(direction, p.normal) > 0.0 ? radiance_from(p, direction) : u_hidden;
    }
    return sun * density + sum / float(u_rays / 2);
}

vec3 outgoing_radiance(Place p) {
    float k = sharpness_of_roughness(p.material.roughness);
    float f = schlick(dot(p.normal, p.towards_eye), p.material.roughness);
    vec3 sun = sun_irradiance_at(p), matt = sun * max(dot(p.normal, u_sun.axis), 0.0) / PI + sky_radiance(p);
    return mix(p.material.albedo * matt, mirrored_radiance(p, sun, k), f);
}

void main() {
    ivec2 px = ivec2(gl_FragCoord.xy) & 1;
    vec2 post = post_of_sample((px.x + 2 * px.y) % SAMPLES);  // neighbouring pixels take different samples
    if (is_sky(post)) {
        vec3 direction = view_ray(vec2(0.0)).along;
        out_colour = vec4(sky_light(direction) + sun_disc(direction), 0.0);
        return;
    }
    seed_random(ivec2(picture_px(gl_FragCoord) * 64.0), u_run);
    Place p = place_at(post);
    out_colour = vec4(hazed(outgoing_radiance(p), -p.towards_eye, p.distance_m), 1.0);
}
