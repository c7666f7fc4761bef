// shade/shaded.frag — style "shaded": land and water in the light of sun and sky, seen through the air.

#include "shade/samples.glsl"
#include "light/water.glsl"
#include "light/shown.glsl"
#include "light/around.glsl"

// The share of the pixel that sees a lake: land that is marked as water. Diagrams and pictures of the ground have none.
float lake_share(Ground g) {
    if (!MARKED || IS_DIAGRAM) return 0.0;
    float sum = 0.0;
    int left = g.samples;
    do {
        sum += smoothstep(0.3, 0.7, marked_at(post_of_sample(findLSB(left))).y);
        left &= left - 1;
    } while (left != 0);
    return sum / float(bitCount(g.samples)) * (PICTURED ? 1.0 - picture_of(g.post, g.extent).a : 1.0);
}

vec3 ground_colour(Ground g, int sample_) {
    Ray ray = ray_at(offset_of(g.samples));
    bool is_flooded = WATER == 1 && g.fine.height_m < u_water_m && water_depth(ray) >= 0.0;
    float lake = WATER == 1 ? lake_share(g) : 0.0, wet = is_flooded ? 1.0 : lake;
    float bed = is_flooded ? bed_seen(g.post) * (1.0 - lake) : 0.0;
    vec3 land = vec3(0.0);
    if (wet < 1.0 || bed > 0.0) land = outgoing_light(g.towards_eye, lit_ground(g));
    if (wet == 0.0) return land_colour(g, land, g.distance_m);
    vec3 at_m = is_flooded ? ray.start + ray.along * water_depth(ray) : g.from_eye_m;
    vec3 direction = direction_to(at_m);
    float level_m = is_flooded ? u_water_m : g.fine.height_m, way_m = is_orthographic() ? 0.0 : length(at_m);
    vec3 water = water_light(post_at(at_m.xy), -direction, level_m, level_m - g.fine.height_m, land, bed);
    water = seen_afar(water, direction, way_m);
    return tone_mapped(u_exposure * mix(hazed(land, -g.towards_eye, g.distance_m), water, wet));
}

vec4 colour_of_pixel() { return shown(pixel_colour()); }

#include "shade/pixel.glsl"
