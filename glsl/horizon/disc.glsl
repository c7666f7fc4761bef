// horizon/disc.glsl — the share of the sun's disc above a horizon.
//   If the horizon is x radii below the disc's centre, the share is 1/2 + (x √(1 − x²) + asin x) / π:
//   a circular segment.
// Provides disc_share().   Python twin: reference.disc_share

uniform float u_sun_elevation;  // radians
uniform float u_sun_radius;     // radians

// soft: if the disc's radius is smaller than this, in radians, this is taken instead
float disc_share(float horizon_sine, float soft) {
    float x = clamp((u_sun_elevation - asin(clamp(horizon_sine, -1.0, 1.0))) / max(u_sun_radius, soft), -1.0, 1.0);
    return 0.5 + (x * sqrt(1.0 - x * x) + asin(x)) / 3.14159265;
}
