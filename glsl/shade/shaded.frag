// shade/shaded.frag — style "shaded": land and water in the light of sun and sky, seen through the air.

#include "shade/samples.glsl"
#include "light/water.glsl"
#include "light/shown.glsl"
#include "light/around.glsl"

vec3 ground_colour(Ground g, int sample_) {
    vec3 light = outgoing_light(g.towards_eye, lit_ground(g));
    Ray ray = ray_at(offset_of(g.samples));
    if (WATER_LEVEL == 0 || g.fine.height_m >= u_water_m || water_depth(ray) < 0.0)
        return land_colour(g, light, g.distance_m);
    vec3 at_m = ray.start + ray.along * water_depth(ray);
    Ray seen = view_ray(offset_of(g.samples));
    float way_m = is_orthographic() ? 0.0 : length(at_m);
    light = water_light(post_at(at_m.xy), -seen.along, u_water_m - g.fine.height_m, light, bed_seen(g.post));
    return tone_mapped(u_exposure * seen_afar(light, seen.along, way_m));
}

vec4 colour_of_pixel() { return shown(pixel_colour()); }

#include "shade/pixel.glsl"
