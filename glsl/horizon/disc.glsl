// horizon/disc.glsl — the share of the sun's disc above a horizon.
//   If the horizon is x radii below the disc's centre, the share is 1/2 + (x √(1 − x²) + asin x) / π:
//   a circular segment.
// Provides disc_share().   Python twin: reference.disc_share

// The table of sunlight: horizon/sunlit.comp.
#define SUN_LAYERS 5
#define SUN_STEPS 8191.0  // 14 bits with the sign: boxes of up to 2^18 blocks, 1024 × 1024 posts, are exact
#define STEEPEST 4.0      // the slope that the table stores as 1

uniform float u_sun_elevation;  // radians
uniform float u_sun_radius;     // radians

float disc_share(float horizon_sine) {
    float x = clamp((u_sun_elevation - asin(clamp(horizon_sine, -1.0, 1.0))) / u_sun_radius, -1.0, 1.0);
    return 0.5 + (x * sqrt(1.0 - x * x) + asin(x)) / 3.14159265;
}
