// light/air.glsl — aerial perspective: the air between eye and land absorbs light and adds light.
//   The land's light is multiplied by e^(−t). t grows with the way through the air, and is largest for blue. The added
//   light is that of the sky near the horizon in the same direction. So land far away fades into the sky behind it.
// Provides hazed().

#include "light/dome.glsl"

#define HAZE_THICKNESS 0.1  // height of the haze, as a fraction of u_haze_m; a steep ray soon leaves the haze

vec3 hazed(vec3 light, vec3 direction, float distance_m) {
    float within_m = distance_m / (1.0 + abs(direction.z) * distance_m / (HAZE_THICKNESS * u_haze_m));
    vec3 through = exp(-vec3(0.70, 0.95, 1.35) * within_m / u_haze_m);
    vec3 low = normalize(vec3(direction.xy, clamp(direction.z, 0.03, 0.06)) + vec3(1e-6, 0.0, 0.0));
    return mix(sky_blurred(low, 60.0), light, through);
}
