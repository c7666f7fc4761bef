// light/around.glsl — the light of the map's surroundings (shade/edge.glsl):
//   its cut sides, the plain, the sea, the sky. They are lit like open ground: without shadows, by the whole sky. The
//   block of the map hides a part of the light from the plain around it.
// Provides sky_colour() where EDGE is not 0.

#include "shade/edge.glsl"
#include "light/lit.glsl"
#include "light/water.glsl"
#include "light/shown.glsl"

uniform bool u_edge_is_sea;

vec3 open_light(Material material, vec3 normal, vec3 towards_eye) {
    Lit l;
    l.lobe = merged_at(normal, material);
    l.sun = l.unshadowed = max(dot(normal, u_sun.axis), 0.0);
    add_sky(l, towards_eye, mat4x3(vec3(1.0), vec3(1.0), vec3(1.0), vec3(1.0)));
    return outgoing_light(towards_eye, l);
}

// The sea of a map that is drawn as a diagram has the colour of the map there.
Material plain_material(vec2 place) {
    if (IS_DIAGRAM && u_edge_is_sea) return land_of(place, vec2(0.0), Relief(u_edge_m, vec2(0.0)));
    if (LOOK == EARTH) return Material(vec3(0.140, 0.132, 0.095), 0.95);
    if (LOOK != NATURAL) return Material(vec3(0.24), 0.95);
    return Material(mix(vec3(0.090, 0.104, 0.048), vec3(0.205, 0.165, 0.110), climate_at(place).dryness), 0.95);
}

// Soil and layers of rock. The thickness of the layers depends on the span of the map's heights.
vec3 wall_light(vec2 place, float up_m, float depth_m, vec3 towards_eye) {
    float high_m = max(rim_m_at(place) - u_edge_m, 1e-3);
    float thick_m = 0.25 * u_span_m + 1e-3;
    float footprint = w_at(depth_m) * 2.0 * u_half_extent.y / float(u_size_px.y);
    float layer = noise(vec2(up_m / thick_m * 3.0, 7.0), 1.0, vec2(3.0 * footprint / thick_m, 0.0))
        + 0.6 * noise(vec2(up_m / thick_m * 9.0, 3.0), 1.0, vec2(9.0 * footprint / thick_m, 0.0));
    vec3 albedo = LOOK == GREY ? vec3(0.20)
        : mix(vec3(0.150, 0.120, 0.095), vec3(0.230, 0.195, 0.155), clamp(0.5 + layer, 0.0, 1.0));
    float foot = smoothstep(0.0, 0.5, (up_m - u_edge_m) / high_m);
    return open_light(Material(albedo, 0.95), wall_normal(place), towards_eye) * mix(0.55, 1.0, foot);
}

vec3 plain_light(vec2 at_m, vec3 towards_eye) {
    bool is_water = WATER == 1 && u_edge_is_sea && (!IS_DIAGRAM || u_water_m == u_edge_m);
    if (is_water) return water_light(post_at(at_m), towards_eye, u_edge_m, 0.0, vec3(0.0), 0.0);
    vec2 low = post_from_eye_m(ivec2(0, u_last_post.y)), high = post_from_eye_m(ivec2(u_last_post.x, 0));
    float away_m = length(max(max(low - at_m, at_m - high), 0.0));
    float high_m = max(0.5 * u_span_m, 0.01 * (high.x - low.x));
    float shaded = u_edge_is_sea ? 0.0 : 0.5 * exp(-away_m / high_m);
    return open_light(plain_material(rim_place(at_m, low)), vec3(0.0, 0.0, 1.0), towards_eye) * (1.0 - shaded);
}

// The plain of a round Earth ends at the limb.
// Its distance from the eye is r = √(h / bend), and its slope below the horizontal is 2 √(h · bend),
// for an eye at the height h. On a flat Earth the slope is 0, and there is no limb.
float limb_root(float factor) { return sqrt(max(-up_from_eye_m(u_edge_m), 0.0) * factor); }

vec3 low_sky(vec3 direction) { return sky_light(normalize(vec3(direction.xy, 0.01 * length(direction.xy)))); }

// The sky of the dome ends at the horizontal. Near the limb it is drawn lower, so that it reaches the limb.
vec3 open_sky(vec3 direction) {
    float flat_ = length(direction.xy), dip = 2.0 * limb_root(u_bend_per_m) * flat_, up = direction.z;
    if (dip > 0.0) up = max(up + dip * exp(-0.5 * (up + dip) / dip), 0.01 * flat_);
    return sky_light(normalize(vec3(direction.xy, up))) + sun_disc(direction);
}

// The share of the sky's light that covers the plain. It grows with the distance, and towards the limb.
float plain_cover(float distance_m) {
    float towards_limb = u_bend_per_m > 0.0 ? distance_m / max(limb_root(1.0 / u_bend_per_m), 1.0) : 0.0;
    return max(smoothstep(0.7, 6.0, distance_m / u_haze_m), smoothstep(0.2, 1.0, towards_limb));
}

// Light of the plain or of water, as it is seen through the air. It fades into the sky, so there is no line at the
// horizon.
vec3 seen_afar(vec3 light, vec3 direction, float distance_m) {
    return mix(hazed(light, direction, distance_m), low_sky(direction), plain_cover(distance_m));
}

#if EDGE > 0 && PIXELS == OPEN
vec3 sky_colour(Ray ray) { return tone_mapped(u_exposure * open_sky(ray.along)); }
#elif EDGE > 0
vec3 sky_colour(Ray ray) {
    vec3 direction = ray.along;
    ray.along = direction / dot(direction, u_forward.xyz);  // its component along the view is 1
    vec2 place;
    float wall = wall_depth(ray, place), plain = plain_depth(ray);
    if (wall < 0.0 && plain < 0.0) return tone_mapped(u_exposure * open_sky(direction));
    float depth = wall > 0.0 ? wall : plain, distance_m = is_orthographic() ? 0.0 : depth * length(ray.along);
    vec3 at_m = ray.start + ray.along * depth;
    float up_m = at_m.z + drop_m(at_m.xy) + u_eye_z_m + u_eye_z_rest_m;
    vec3 light = wall > 0.0 ? wall_light(place, up_m, depth, -direction) : plain_light(at_m.xy, -direction);
    return tone_mapped(u_exposure * seen_afar(light, direction, distance_m));
}
#endif
