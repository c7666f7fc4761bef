// lod/rings/hidden.glsl — land behind ridges, by a horizon around the eye (Lloyd & Egbert 2002).
//   The plane around the eye is cut into SECTORS wedges. Shell k has the radius
//       r_k = 64 s (2^(k / 45) - 1),      s the smaller of the two spacings of the map.
//   Neighbouring radii differ by about s near the eye, and by about r_k / 64 far away.
//   horizon(i, k) is the largest slope, (height - eye) / distance, of land up to shell k that spans all of sector i.
//   The heights in the horizon are lower bounds of the map's heights. The surface is drawn at most E pixels off, so the
//   eye sees it off by an angle of at most φ = 2 arctan(E / 2K), K the focal length in pixels (docs/hidden.md). So a
//   sight line to a place beyond shell k is blocked if it is more than φ below the horizon. A box is hidden if this
//   holds for its highest sight line, in all sectors that it spans.
// Provides sector_direction(), shell_radius_m(), is_hidden().
// Python twins: reference.sectors_of, reference.sector_directions, reference.is_hidden

#include "lod/rings/leaf.glsl"

layout(binding = 11) uniform sampler2D u_horizon;  // column: sector; row: shell

uniform ivec2 u_sectors;       // the first sector that the picture shows, and the end; equal if nothing is to be hidden
uniform int u_shells;
uniform float u_tan_off;        // tan φ, φ below 90 degrees: lod/hiding.py

#define SHELLS_PER_DOUBLING 45.0
#define SHELL_SPACINGS 64.0
#define SLOPE_SLACK 1e-5  // rounding errors

float shell_unit_m() { return SHELL_SPACINGS * min(u_spacing_m.x, u_spacing_m.y); }
float shell_radius_m(int k) { return shell_unit_m() * (exp2(float(k) / SHELLS_PER_DOUBLING) - 1.0); }

// The last shell within a distance; -1 if there is none.
int shell_within(float r_m) {
    int k = int(SHELLS_PER_DOUBLING * log2(1.0 + r_m / shell_unit_m()));
    return min(shell_radius_m(k) > r_m ? k - 1 : k, u_shells - 1);
}

// Horizontal direction in which the camera looks.
vec2 ahead() {
    float level = length(u_forward.xy);
    return level > 1e-6 ? u_forward.xy / level : vec2(1.0, 0.0);
}

// Sectors are counted from behind the camera to its right, ahead, its left, and back. Angles are measured along a
// square around the eye, without trigonometric functions: their precision differs between drivers.
float sector_of(vec2 from_eye_m) {
    vec2 f = ahead(), p = vec2(dot(f, from_eye_m), f.x * from_eye_m.y - f.y * from_eye_m.x);
    float t = p.y / (abs(p.x) + abs(p.y));
    return (p.x >= 0.0 ? 2.0 + t : p.y >= 0.0 ? 4.0 - t : -t) * (float(SECTORS) / 4.0);
}

vec2 sector_direction(int sector) {
    vec2 f = ahead();
    float a = float(sector) * (4.0 / float(SECTORS)) - 2.0;
    vec2 p = normalize(vec2(1.0 - abs(a), abs(a) <= 1.0 ? a : a > 0.0 ? 2.0 - a : -2.0 - a));
    return vec2(p.x * f.x - p.y * f.y, p.x * f.y + p.y * f.x);
}

// Slope that the horizon must exceed to block a sight line of this slope: that of a line steeper by the angle φ.
float horizon_needed(float slope) {
    float tan_off = u_tan_off + SLOPE_SLACK * (1.0 + u_tan_off), level = 1.0 - slope * tan_off;
    return level > 0.0 ? (slope + tan_off) / level : HUGE;
}

// The first and the last sector of a box, as numbers with fractions.
vec2 sectors_of(Box box) {
    vec2 low = box.low.xy, high = box.high.xy;
    vec4 corner = vec4(sector_of(low), sector_of(high), sector_of(vec2(low.x, high.y)), sector_of(vec2(high.x, low.y)));
    vec2 least = min(corner.xy, corner.zw), most = max(corner.xy, corner.zw);
    return vec2(min(least.x, least.y), max(most.x, most.y));
}

bool is_hidden(Box box) {
    vec2 nearest = clamp(vec2(0.0), box.low.xy, box.high.xy), farthest = max(abs(box.low.xy), abs(box.high.xy));
    float near = length(nearest) * (1.0 - 1e-5), far = length(farthest);
    if (u_sectors.x >= u_sectors.y || near <= 0.0) return false;
    vec2 span = sectors_of(box);
    if (span.y - span.x > 0.5 * float(SECTORS)) return false;  // the box is behind the camera, where sectors begin
    float needed = horizon_needed(box.high.z / (box.high.z > 0.0 ? near : far));
    int i = max(int(floor(span.x - 1e-3)), u_sectors.x), end = min(int(floor(span.y + 1e-3)) + 1, u_sectors.y);
    int k = shell_within(near);
    bool hidden = k >= 0 && i < end;
    for (; hidden && i < end; i++) hidden = texelFetch(u_horizon, ivec2(i, k), 0).x > needed;
    return hidden;
}
