// mesh/bilinear.tese — a vertex of the true surface: on a post, or between posts at the bilinear height
//     h = (1 - s)(1 - t) a + s (1 - t) b + (1 - s) t c + s t d
// From above and in a capture, vertices are on posts only: a vertex between posts moves to the post before it.
// Python twin: verify.holes.bilinear

#include "mesh/shape.glsl"
#include "mesh/between.glsl"
#include "mesh/vertex.glsl"

#ifndef FINER
#define FINER 2
#endif

// rows count southward, so the tessellator's plane is mirrored on the map
layout(quads, equal_spacing, cw) in;

patch in ivec4 v_shape;

void main() {
    Shape s = shape_of(v_shape);
    ivec2 steps = ivec2(round(gl_TessCoord.xy * float(FINER << s.side_log2)));
    ivec2 post = min(s.corner + steps / FINER, u_last_post);
    Patch p = Patch(s.corner, end_of(s), 0.0, false, 0u, -1.0);
#if TO == PICTURE
    vec2 between = vec2(steps % FINER) / float(FINER) * vec2(lessThan(post, u_last_post));
    put_vertex_between(post, between, bilinear_m(post, between), p);
#else
    put_vertex(post, height_m(post), p);
#endif
}
