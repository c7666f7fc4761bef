// shade/drawn.glsl — shared by the styles that show the mesh:
//   the facts that shade/detail.glsl stored, a plain shade, palettes.
// Provides Drawn, drawn_at(), clay(), viridis(), inferno(), error_colour().

#include "shade/samples.glsl"
#include "shade/tone.glsl"

layout(binding = 3) uniform PER_SAMPLE u_drawn;

uniform vec3 u_sun;
uniform float u_error_scale_px;  // the error at the end of the colours; 0: the tolerance

struct Drawn {
    float step_log2;
    float edge, segments_log2, border;
    float px;  // error, or bound
};

Drawn drawn_at(int sample_) {
    vec4 d = texelFetch(u_drawn, ivec2(FRAG_COORD.xy), sample_);
    return Drawn(d.x, d.y, floor(d.z), fract(d.z), d.w);
}

// Brightness of matt white ground under a sun and a white sky.
float clay(Ground g) {
    vec3 normal = normal_of(g.fine.slope);
    return 0.25 + 0.2 * normal.z + 0.55 * max(dot(normal, u_sun), 0.0);
}

// Linear interpolation between five colours, from t = 0 to 1.
vec3 between(vec3 colours[5], float t) {
    float at = 4.0 * clamp(t, 0.0, 1.0);
    int i = min(int(at), 3);
    return mix(colours[i], colours[i + 1], at - float(i));
}

// Viridis and inferno at five places, sRGB (Smith, van der Walt 2015).
vec3 viridis(float t) {
    return between(vec3[5](vec3(0.267, 0.005, 0.329), vec3(0.230, 0.322, 0.546), vec3(0.128, 0.567, 0.551),
        vec3(0.369, 0.789, 0.383), vec3(0.993, 0.906, 0.144)), t);
}

vec3 inferno(float t) {
    return between(vec3[5](vec3(0.001, 0.000, 0.014), vec3(0.342, 0.062, 0.429), vec3(0.736, 0.216, 0.330),
        vec3(0.978, 0.558, 0.035), vec3(0.988, 0.998, 0.645)), t);
}

// Errors from 0 to the tolerance; or to the end of a given scale, where the square root makes small errors visible.
vec3 error_colour(float px) {
    float tolerance_px = u_tolerance_px > 0.0 ? u_tolerance_px : 1.0;
    bool is_given = u_error_scale_px > 0.0;
    float share = px / (is_given ? u_error_scale_px : tolerance_px);
    if (share > 1.001) return vec3(0.0, 0.9, 1.0);
    return inferno(0.08 + 0.92 * (is_given ? sqrt(share) : share));
}
