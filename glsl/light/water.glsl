// light/water.glsl — standing water at one height: the land below shows through it, and the sky is mirrored in it.
//   A ray to land below the level meets the plane of the water first.
//   Ripples are too small to be seen: they are a lobe of half-vectors around the vertical.
// Provides is_under_water(), water_light().

#include "light/lit.glsl"

#define RIPPLES 3000.0  // sharpness of the ripples' lobe
// Share of the light that is absorbed per metre; share of the light from above that is scattered.
const vec3 ABSORBED = vec3(0.35, 0.075, 0.045), SCATTERED = vec3(0.004, 0.015, 0.018);

bool is_under_water(Ground g) { return g.fine.height_m < u_water_m && up_from_eye_m(u_water_m) < 0.0; }

// Radiance towards the eye; surface_m is the distance to the water.
vec3 water_light(Ground g, Lit l, vec3 floor_light, out float surface_m) {
    float down_m = drop_m(g.from_eye_m.xy) - up_from_eye_m(u_water_m);  // the water has the drop of the land
    float slant = max(g.towards_eye.z, 1e-4);
    surface_m = min(down_m / slant, g.distance_m);
    float sun_seen = min(l.sun / max(l.unshadowed, 1e-3), 1.0);
    vec3 from_above = u_sun.amplitude * (u_sun.integral / PI * max(u_sun.axis.z, 0.0) * sun_seen);
    for (int i = 0; i < SKY_LOBES; i++)
        from_above += u_sky[i].amplitude * (u_sky[i].integral / PI * max(u_sky[i].mean_length * u_sky[i].axis.z, 0.0));
    // Length of the light's way in the water: straight down, then back along the refracted ray.
    float deep_m = (u_water_m - g.fine.height_m) * (1.0 + 0.75 / sqrt(1.0 - 0.56 * (1.0 - slant * slant)));
    vec3 through = exp(-ABSORBED * deep_m);
    vec3 below = mix(SCATTERED * from_above, floor_light, through);
    Lobe mirrored = reflection_lobe(mean_length(RIPPLES) * vec3(0.0, 0.0, 1.0), g.towards_eye);
    vec3 glitter = sg_inner_product(light_lobe(u_sun), mirrored) * sun_seen;
    vec3 mirror = sky_blurred(normalize(vec3(mirrored.axis.xy, max(mirrored.axis.z, 0.01))), mirrored.sharpness)
        + glitter;
    return mix(below, mirror, schlick(slant, 0.0));
}
