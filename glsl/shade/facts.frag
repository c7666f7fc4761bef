// shade/facts.frag — what a pixel shows: view depth, kind, place and normal, all from the same samples.
//   The kind is that of most samples. Of these samples, those on the same surface count, and the place is on the ray
//   through their middle: the middle of the pixel, unless an edge passes through it.
//   FACTS 0: place east, north, up from the eye; view depth        FACTS 1: normal; kind, one of renderer.facts.KINDS

#include "shade/samples.glsl"
#include "shade/marks.glsl"

#ifndef FACTS
#define FACTS 0
#endif

uniform float u_level_m;  // height of standing water above the base; far below it if there is none
uniform bool u_edge_is_sea;

out vec4 out_fact;

vec3 ground_colour(Ground g, int sample_) { return vec3(0.0); }
vec3 sky_colour(Ray ray) { return vec3(0.0); }

// Surfaces. A lake of the map is land that is marked as water.
#define OPEN_SKY 0
#define GROUND 1
#define FLOOD 2
#define LAKE 3
#define FILLED_VOID 4
#define SEA 5
#define PLAIN 6
#define WALL 7
const int KIND_OF[8] = int[8](0, 1, 2, 2, 4, 2, 3, 3);

int surface_of_sample(int i) {
    vec2 post = post_of_sample(i);
    Ray ray = ray_at(offset_of_sample(i));
    if (is_sky(post)) {
        int around = surroundings_at(ray);
        return around == 0 ? OPEN_SKY : around > 1 ? WALL : u_edge_is_sea ? SEA : PLAIN;
    }
    float flood = plane_depth(ray, u_level_m), land = view_depth_m(texelFetch(u_depth, ivec2(FRAG_COORD.xy), i).x);
    if (flood > 0.0 && flood < land) return FLOOD;
    if (!MARKED) return GROUND;
    if (is_hole(min(ivec2(post), u_last_post - 1))) return FILLED_VOID;
    return marked_at(post).y >= 0.5 ? LAKE : GROUND;
}

void main() {
    find_hidden();
    int surface[4] = int[4](-1, -1, -1, -1), best = 0;
    for (int i = 0; i < SAMPLES; i++) surface[i] = surface_of_sample(i);
    for (int i = 0; i < SAMPLES; i++) {
        int alike = 0;
        for (int j = 0; j < SAMPLES; j++) alike |= int(surface[j] == surface[i]) << j;
        if (bitCount(alike) > bitCount(best)) best = alike;
    }
    int kind = surface[findLSB(best)];
    bool is_land = kind == GROUND || kind == LAKE || kind == FILLED_VOID;
    if (is_land) best &= samples_near(footprint_at(post_of_sample(findLSB(best)))) | 1 << findLSB(best);
    Ray ray = ray_at(offset_of(best));
    vec3 normal = vec3(0.0, 0.0, kind == OPEN_SKY ? 0.0 : 1.0);
    float depth = 1.0 / 0.0;
    vec2 place;
    if (is_land) {
        float sum = 0.0;
        for (int i = 0; i < SAMPLES; i++)
            sum += float(best >> i & 1) * texelFetch(u_depth, ivec2(FRAG_COORD.xy), i).x;
        depth = view_depth_m(sum / float(bitCount(best)));  // on a plane, values of the depth buffer are linear
#if FACTS == 1
        if (kind != LAKE) normal = normal_of(ground_of(best).fine.slope);
#endif
    }
    else if (kind == FLOOD) depth = plane_depth(ray, u_level_m);
    else if (kind == WALL) {
        depth = wall_depth(ray, place);
        normal = wall_normal(place);
    }
    else if (kind != OPEN_SKY) depth = plain_depth(ray);
    out_fact = FACTS == 0 ? vec4(ray.start + ray.along * depth, depth) : vec4(normal, float(KIND_OF[kind]));
}
