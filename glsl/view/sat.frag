// view/sat.frag — the summed-area table of heights as a picture, north up.
//   Grey levels show S modulo 2^32, from black to white, again and again where it wraps.
//   Marks show the four corners from which a box is read.

#include "sat/box.glsl"

layout(std430, binding = 0) readonly buffer Sums { uint sums[]; };
#define SUMS(i) sums[i]

uniform ivec4 u_frame_px;  // left, bottom, width, height in the window
uniform ivec2 u_size;      // columns and rows of the table
uniform int u_first;       // its first word
uniform int u_width;       // words from one row to the next
uniform ivec4 u_box;       // first column, first row; then the column and the row after the last

out vec4 out_colour;

vec3 shade(float t) { return mix(vec3(0.03, 0.05, 0.10), vec3(0.75, 0.86, 1.0), t); }

void main() {
    vec2 share = (gl_FragCoord.xy - vec2(u_frame_px.xy)) / vec2(u_frame_px.zw);
    vec2 place = vec2(share.x, 1.0 - share.y) * vec2(u_size);
    Table table = Table(uint(u_first), ivec2(u_width, u_size.y));
    ivec2 at = clamp(ivec2(place), ivec2(0), u_size - 1) + 1;
    uint s = SAT(uint, SUMS, table, 0, at.x, at.y);
    vec3 colour = shade(float(s) / 4294967296.0);
    vec2 low = vec2(u_box.xy), high = vec2(u_box.zw), posts_per_px = vec2(u_size) / vec2(u_frame_px.zw);
    vec2 inside = min(place - low, high - place) / posts_per_px;
    if (min(inside.x, inside.y) > 0.0) colour = mix(colour, vec3(1.0, 0.80, 0.47), 0.35);
    if (abs(min(inside.x, inside.y)) < 1.0) colour = vec3(1.0, 0.80, 0.47);
    for (int i = 0; i < 4; i++) {
        vec2 corner = mix(low, high, vec2(i & 1, i >> 1));
        float d = length((place - corner) / posts_per_px);
        bool adds = i == 0 || i == 3;
        if (d < 5.0) colour = adds ? vec3(0.45, 0.95, 0.55) : vec3(1.0, 0.45, 0.40);
    }
    out_colour = vec4(colour, 1.0);
}
