// light/water.glsl — standing water: one surface, over drowned land, in the lakes of the map, and around the map.
//   A ray that meets the plane of the water sees it there. A lake of the map is at the height of its posts.
//   The sky is mirrored in water, and the bed shows through it.
//   Its normal is the vertical. Ripples are too small to be seen: they are a lobe of half-vectors around it.
//   The sun's light on it is hidden by land alone: a march towards the sun compares heights with the sun's ray.
//   The map ends at its rim, and with it the bed. Near the rim the bed fades, so the sea around has no edge.
// Provides water_depth(), water_light(), bed_seen().

#include "light/lit.glsl"

#ifndef WATER
#define WATER 1  // 0 without water: its code is then left out
#endif
#define RIPPLES 3000.0  // sharpness of the ripples' lobe
#define SHADOW_STEPS 48
#define BED_FADES 0.02  // distance from the rim, as a share of the map's shorter side, from which on the bed fades
// Share of the light that is absorbed per metre; share of the light from above that is scattered.
const vec3 ABSORBED = vec3(0.35, 0.075, 0.045), SCATTERED = vec3(0.004, 0.015, 0.018);

float water_depth(Ray ray) { return plane_depth(ray, u_water_m); }

// The share of the sun's disc that is visible from the water, at a place in posts that may lie beyond the map.
float sun_on_water(vec2 post, float level_m) {
    vec3 sun = u_sun.axis;
    float level = max(length(sun.xy), 1e-6), rise = sun.z / level;
    if (rise <= 0.0) return 0.0;
    vec2 towards = vec2(sun.x, -sun.y) / level / u_spacing_m;  // posts per metre along the ground
    towards = mix(towards, vec2(1e-9), lessThan(abs(towards), vec2(1e-9)));
    vec2 a = -post / towards, b = (vec2(u_last_post) - post) / towards, first = min(a, b), last = max(a, b);
    float from_m = max(max(first.x, first.y), 0.0), above_m = highest_m() - level_m;
    float to_m = min(min(last.x, last.y), above_m / rise), step_m = (to_m - from_m) / float(SHADOW_STEPS);
    if (step_m <= 0.0) return 1.0;
    float clear = 1e30;  // smallest tangent of an angle between the sun and the land below it
    for (int i = 0; i < SHADOW_STEPS; i++) {
        float along_m = from_m + (float(i) + 0.5) * step_m;
        float land_m = rim_m_at(clamp(post + along_m * towards, vec2(0.0), vec2(u_last_post)));
        clear = min(clear, (level_m + rise * along_m - land_m) / along_m);
    }
    // land between two steps may be a little higher: the shadow's edge is as soft as the steps are wide
    float soft = 0.01 + 0.5 * step_m * rise / max(to_m, 1e-6);
    return smoothstep(-soft, soft, clear);
}

// The share of the bed's light that the map shows at a place: 0 on its rim.
float bed_seen(vec2 post) {
    vec2 off_m = min(post, vec2(u_last_post) - post) * u_spacing_m, size_m = vec2(u_last_post) * u_spacing_m;
    return smoothstep(0.0, 1.0, min(off_m.x, off_m.y) / (BED_FADES * min(size_m.x, size_m.y)));
}

// Radiance towards the eye from a place on the water, in posts.
// The bed is below_m deeper; a share of its light is seen.
vec3 water_light(vec2 post, vec3 towards_eye, float level_m, float below_m, vec3 bed_light, float share) {
    float slant = max(towards_eye.z, 1e-4), sun_seen = sun_on_water(post, level_m);
    vec3 from_above = u_sun.amplitude * (u_sun.integral / PI * max(u_sun.axis.z, 0.0) * sun_seen);
    for (int i = 0; i < SKY_LOBES; i++)
        from_above += u_sky[i].amplitude * (u_sky[i].integral / PI * max(u_sky[i].mean_length * u_sky[i].axis.z, 0.0));
    // Length of the light's way in the water: straight down, then back along the refracted ray.
    float deep_m = below_m * (1.0 + 0.75 / sqrt(1.0 - 0.56 * (1.0 - slant * slant)));
    vec3 below = mix(SCATTERED * from_above, bed_light, share * exp(-ABSORBED * deep_m));
    Lobe mirrored = reflection_lobe(mean_length(RIPPLES) * vec3(0.0, 0.0, 1.0), towards_eye);
    vec3 glitter = sg_inner_product(light_lobe(u_sun), mirrored) * sun_seen;
    vec3 mirror = sky_blurred(normalize(vec3(mirrored.axis.xy, max(mirrored.axis.z, 0.01))), mirrored.sharpness)
        + glitter;
    return mix(below, mirror, schlick(slant, 0.0));
}
