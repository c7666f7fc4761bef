// shade/sun_sweep.comp — how much of the sun each post sees, a line of posts after the other, away from the sun.
//   Every post hides the sun from all below the ray that grazes it. That plane of shadow falls by u_fall_m from a line to
//   the next:
//
//     shadow(p) = max(shadow(q), h(q)) − fall,   q where the ray from p to the sun crosses the line before
//
//                 ·  .                         sun ↖        q lies between two posts: both are blended, and shadows
//       h(q) ▲        ·  .                                  grow softer with distance as they do in nature.
//      ██████████        ·  .  shadow(p)
//      ████████████████  p
//
//   Two reads a post whatever the shadows' length (Giles 1990 sweeps horizons so). Python twin: reference.shadow_heights

#include "blocks/terrain.glsl"

layout(local_size_x = 64) in;
layout(r8, binding = 0) uniform writeonly image2D u_visibility;
layout(std430, binding = 1) buffer Shadow { float shadow_m[]; };  // two lines, used in turn

uniform int u_line;        // 0 nearest to the sun
uniform bool u_by_column;  // lines are columns
uniform bool u_backward;   // line 0 is the last column or row
uniform float u_shift;     // posts along the line to the crossing, -1 to 1
uniform float u_fall_m;    // of the ray, from a line to the next
uniform float u_soft_m;    // half height of the blur at the shadow's rim

ivec2 line_and_place(ivec2 size) { return u_by_column ? size : size.yx; }

ivec2 post_of(int line, int place) {
    ivec2 lines = line_and_place(u_last_post);
    int at = u_backward ? lines.x - line : line;
    return u_by_column ? ivec2(at, place) : ivec2(place, at);
}

float highest_m(int line, int place) {
    int length_ = line_and_place(u_last_post).y + 1;
    return max(shadow_m[(line & 1) * length_ + place], height_m(post_of(line, place)));
}

void main() {
    int place = int(gl_GlobalInvocationID.x), length_ = line_and_place(u_last_post).y + 1;
    if (place >= length_) return;

    float crossing = float(place) + u_shift, shadow = -1e30;
    if (u_line > 0 && crossing >= 0.0 && crossing <= float(length_ - 1)) {
        int a = int(floor(crossing)), b = min(a + 1, length_ - 1);
        shadow = mix(highest_m(u_line - 1, a), highest_m(u_line - 1, b), fract(crossing)) - u_fall_m;
    }
    shadow_m[(u_line & 1) * length_ + place] = shadow;
    ivec2 post = post_of(u_line, place);
    imageStore(u_visibility, post, vec4(smoothstep(-u_soft_m, u_soft_m, height_m(post) - shadow)));
}
