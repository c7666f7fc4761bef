// horizon/disc.glsl — how much of the sun's disc stands over a horizon.
//   A horizon at x radii below the disc's middle leaves 1/2 + (x √(1 − x²) + asin x) / π of it: a segment of a circle.
// Provides disc_share().   Python twin: reference.disc_share

uniform float u_sun_elevation;  // radians
uniform float u_sun_radius;     // radians

// soft: half width in radians over which a picture cannot tell, beside the disc's own radius
float disc_share(float horizon_sine, float soft) {
    float x = clamp((u_sun_elevation - asin(clamp(horizon_sine, -1.0, 1.0))) / max(u_sun_radius, soft), -1.0, 1.0);
    return 0.5 + (x * sqrt(1.0 - x * x) + asin(x)) / 3.14159265;
}
