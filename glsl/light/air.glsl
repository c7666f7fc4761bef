// light/air.glsl — what the air between eye and land takes and adds: aerial perspective.
//   Light is lost to e^(−t), blue first; what is added is the sky's own light from that direction, near the horizon, where
//   the air is seen at its longest: far land fades into the sky behind it.
// Provides hazed().

#include "light/dome.glsl"

#define HAZE_THICKNESS 0.1  // of u_haze_m: haze lies low, and a ray that rises or falls steeply is soon out of it

vec3 hazed(vec3 light, vec3 direction, float distance_m) {
    float within_m = distance_m / (1.0 + abs(direction.z) * distance_m / (HAZE_THICKNESS * u_haze_m));
    vec3 through = exp(-vec3(0.70, 0.95, 1.35) * within_m / u_haze_m);
    vec3 low = normalize(vec3(direction.xy, clamp(direction.z, 0.03, 0.06)) + vec3(1e-6, 0.0, 0.0));
    return mix(sky_blurred(low, 60.0), light, through);
}
