// shade/sky.glsl — a clear sky in closed form, and the light that comes from it.
// Provides sky_light(), sun_light(), hazed().

uniform vec3 u_sun;         // towards it, unit
uniform float u_haze_m;     // distance at which haze lets 1/e through

// Low suns are warm: their light crosses more air, which takes the blue out.
vec3 sun_light() {
    float air = 1.0 / (max(u_sun.z, 0.0) + 0.12);
    float risen = smoothstep(-0.06, 0.06, u_sun.z);
    return 3.6 * risen * exp(-vec3(0.035, 0.075, 0.16) * air);
}

vec3 zenith_light() { return mix(vec3(0.010, 0.016, 0.035), vec3(0.11, 0.24, 0.55), smoothstep(-0.15, 0.35, u_sun.z)); }

vec3 horizon_light() {
    vec3 day = vec3(0.62, 0.76, 0.92), dusk = vec3(0.80, 0.58, 0.42);
    return mix(mix(vec3(0.03, 0.035, 0.05), dusk, smoothstep(-0.15, 0.05, u_sun.z)), day, smoothstep(0.0, 0.45, u_sun.z));
}

// Air scatters sunlight forward: a glow around the sun, strongest in haze near the horizon.
vec3 glow(vec3 direction) {
    float towards = max(dot(direction, u_sun), 0.0), low = exp(-6.0 * max(direction.z, 0.0));
    return sun_light() * (0.10 * pow(towards, 6.0) * low + 0.16 * pow(towards, 64.0) + 0.3 * pow(towards, 900.0));
}

vec3 air_light(vec3 direction) {
    float height = max(direction.z, 0.0);
    return mix(zenith_light(), horizon_light(), exp(-5.0 * height)) + glow(direction);
}

vec3 sky_light(vec3 direction) {
    float disc = smoothstep(0.99993, 0.99997, dot(direction, u_sun));
    return air_light(direction) + 12.0 * disc * sun_light() * step(0.0, direction.z);
}

vec3 hazed(vec3 light, vec3 direction, float distance_m) {
    vec3 through = exp(-vec3(0.75, 0.95, 1.25) * distance_m / u_haze_m);
    return mix(air_light(vec3(direction.xy, max(direction.z, 0.02))), light, through);
}
