// truth/ground.glsl — the true ground at one place:
//   bilinear heights, and normals that are interpolated between the centres of cells.
//   Rays march through it, and it is lit by brute force.
// Provides ground_m(), slope_of_cells(), sees().   Python twins: reference.bilinear_heights, reference.horizon_sines

#include "horizon/cell.glsl"

float ground_m(vec2 post) {
    vec2 p = clamp(post, vec2(0.0), vec2(u_last_post));
    ivec2 at = min(ivec2(p), u_last_post - 1);
    vec2 t = p - vec2(at);
    float north = mix(height_m(at), height_m(at + ivec2(1, 0)), t.x);
    float south = mix(height_m(at + ivec2(0, 1)), height_m(at + 1), t.x);
    return mix(north, south, t.y);
}

// March from the ground at a place until the ray meets the ground, or can no longer meet it.
bool sees(vec2 post, float from_m, vec3 direction) {
    vec2 aside = vec2(direction.x, -direction.y) / u_spacing_m;
    float along = max(abs(aside.x), abs(aside.y));
    if (along < 1e-6) return direction.z > 0.0;
    vec2 step_ = aside / along;
    float rise_m = direction.z / along, top_m = highest_m();
    for (float t = 0.25; t < 40000.0; t += t < 4.0 ? 0.25 : t < 16.0 ? 0.5 : 1.0) {
        vec2 at = post + step_ * t;
        float ray_m = from_m + rise_m * t;
        if (ray_m > top_m || any(lessThan(at, vec2(0.0))) || any(greaterThan(at, vec2(u_last_post)))) return true;
        if (ground_m(at) > ray_m) return false;
    }
    return true;
}

// Slopes of cells, bilinear between their centres.
vec2 slope_of_cells(vec2 post) {
    ivec2 last = u_last_post - 1;
    vec2 at = clamp(post - 0.5, vec2(0.0), vec2(last)), t = fract(at), slope = vec2(0.0);
    for (int i = 0; i < 4; i++) {
        ivec2 corner = ivec2(i & 1, i >> 1);
        vec3 normal = normal_of_cell(min(ivec2(at) + corner, last));
        vec2 weight = mix(1.0 - t, t, vec2(corner));
        slope -= weight.x * weight.y * normal.xy / normal.z;
    }
    return slope;
}
