// shade/contours.glsl — contour lines over the land as it is drawn: they have the errors of the drawn land.
//   height = z + drop + the eye's height              of the place that a sample sees, from its depth
//   level  = height / interval                        lines are at whole numbers, index lines at every fifth
//   rise   = levels that one pixel spans              the gradient over the pixel's four samples, by least squares:
//                                                     (sum of xᵢ hᵢ, sum of yᵢ hᵢ) / sum of xᵢ², as sum of xᵢ yᵢ = 0;
//                                                     (xᵢ, yᵢ) is the offset of sample i in the pixel, hᵢ its level
//   cover  = width/2 + 1/2 − |level − round| / rise   the share of the pixel that the line covers (box filter)
//   So a line has one width in the picture, on a cliff and at a grazing angle, too.
//   Lines fade where they are only a few pixels apart; index lines fade where lines are five times closer.
// Provides contoured().   Python twin: reference.contour_cover

#include "shade/footprint.glsl"

#ifndef CONTOURS
#define CONTOURS 0  // 1 where contour lines are drawn
#endif

#define CONTOUR_PX 1.2
#define INDEX_PX 2.2
#define INDEX_EVERY 5.0
#define DENSE 0.16   // lines fade from this number of levels in a pixel on,
#define DENSEST 0.3  // and end here
#define SPREAD 0.3125      // sum of xᵢ² over SAMPLE_AT, and of yᵢ²
#define DEPTH_STEPS 1e-6   // of the distance: a gradient below this may be rounding of depths alone

// In metres: the interval; an offset of heights, modulo the interval of index lines; the least height with lines.
uniform vec3 u_contours;

float contour_cover(float level, float rise, float width_px) {
    float aside_px = abs(level - round(level)) / max(rise, 1e-7);
    return clamp(0.5 * width_px + 0.5 - aside_px, 0.0, 1.0) * (1.0 - smoothstep(DENSE, DENSEST, rise));
}

float height_of_sample_m(int i) {
    vec3 at_m = place_of_sample_m(i, texelFetch(u_depth, ivec2(FRAG_COORD.xy), i).x);
    precise float h_m = (at_m.z + drop_m(at_m.xy) + u_eye_z_rest_m) + u_eye_z_m;
    return h_m;
}

// Metres of height that one pixel spans on the plane of the ground. This is used where few samples see the ground, and
// where the land is so flat that depths are too coarse.
float rise_of_plane_m(Ground g) {
    float pixel_m = w_at(dot(-g.towards_eye, u_forward.xyz) * g.distance_m) / u_focal_px;
    vec3 normal = seen_normal(g.fine.slope, g.from_eye_m);
    vec2 right = slide_to_ground(u_right.xyz * (pixel_m / u_aspect), -g.towards_eye, normal) * u_spacing_m;
    vec2 up = slide_to_ground(u_up.xyz * pixel_m, -g.towards_eye, normal) * u_spacing_m;
    return length(vec2(dot(g.fine.slope, right), dot(g.fine.slope, up)));
}

// The ground's colour with its lines; `samples`: the samples that see it, as bits.
vec3 contoured(vec3 colour, Ground g, int samples) {
    if (CONTOURS == 0) return colour;
    float first_m = height_of_sample_m(findLSB(samples)), sum_m = 0.0;
    vec2 gradient_m = vec2(0.0);
    for (int i = 0; i < SAMPLES; i++) {
        if ((samples >> i & 1) == 0) continue;
        float above_m = height_of_sample_m(i) - first_m;
        sum_m += above_m;
        gradient_m += offset_of_sample(i) * above_m / SPREAD;
    }
    float height_m = first_m + sum_m / float(bitCount(samples)), rise_m = length(gradient_m);
    if (height_m < u_contours.z) return colour;
    if (SAMPLES < 4 || bitCount(samples) < SAMPLES || rise_m < DEPTH_STEPS * g.distance_m) rise_m = rise_of_plane_m(g);
    float level = (height_m + u_contours.y) / u_contours.x, rise = rise_m / u_contours.x;
    float thin = 0.6 * contour_cover(level, rise, CONTOUR_PX);
    float index = 0.8 * contour_cover(level / INDEX_EVERY, rise / INDEX_EVERY, INDEX_PX);
    return colour * (1.0 - max(thin, index));
}
