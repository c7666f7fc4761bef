// shade/contours.glsl — contour lines over the land, from the mean height of a pixel's footprint; no geometry.
//   level  = height / interval                        lines are at whole numbers, index lines at every fifth
//   rise   = levels that one pixel spans              length of the slope along the pixel's sides u and v
//   cover  = width/2 + 1/2 − |level − round| / rise   the share of the pixel that the line covers (box filter)
//   Lines fade where they are only a few pixels apart; index lines fade where lines are five times closer.
// Provides contoured().   Python twin: reference.contour_cover

#include "shade/footprint.glsl"

#ifndef CONTOURS
#define CONTOURS 0  // 1 where they are drawn
#endif

#define CONTOUR_PX 1.2
#define INDEX_PX 2.2
#define INDEX_EVERY 5.0
#define DENSE 0.16   // lines fade from this number of levels in a pixel on,
#define DENSEST 0.3  // and end here

// In metres: the interval; an offset of heights, modulo the interval of index lines; the least height with lines.
uniform vec3 u_contours;

float contour_cover(float level, float rise, float width_px) {
    float aside_px = abs(level - round(level)) / max(rise, 1e-7);
    return clamp(0.5 * width_px + 0.5 - aside_px, 0.0, 1.0) * (1.0 - smoothstep(DENSE, DENSEST, rise));
}

vec3 contoured(vec3 colour, Ground g) {
    if (CONTOURS == 0 || g.fine.height_m < u_contours.z) return colour;
    vec2 east_north = vec2(1.0, -1.0) * u_spacing_m / u_contours.x;
    float rise = length(vec2(dot(g.fine.slope, g.u * east_north), dot(g.fine.slope, g.v * east_north)));
    float level = (g.fine.height_m + u_contours.y) / u_contours.x;
    float thin = 0.6 * contour_cover(level, rise, CONTOUR_PX);
    float index = 0.8 * contour_cover(level / INDEX_EVERY, rise / INDEX_EVERY, INDEX_PX);
    return colour * (1.0 - max(thin, index));
}
