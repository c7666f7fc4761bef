// tessellated/measures.glsl — how long segments are to be.
// Provides u_edge_px, segment_m().

#include "blocks/view.glsl"

layout(std140, binding = 4) uniform Tessellated {
    float u_edge_px;  // wanted length of a segment on the screen
};

// Depth of what is so far away from the eye, in the middle of the picture; less off its axis, but within it.
float depth_of(vec3 from_eye) {
    float away = length(from_eye);
    return max(max(dot(from_eye, u_forward.xyz), away * inversesqrt(1.0 + dot(u_half_extent, u_half_extent))), near_m());
}

// Metres that are u_edge_px pixels long there, seen from the side.
float segment_m(vec3 from_eye) { return u_edge_px * depth_of(from_eye) / u_focal_px; }
