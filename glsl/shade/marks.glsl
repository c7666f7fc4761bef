// shade/marks.glsl — marks of posts: voids that are filled, and water.
// Provides MARKED, marked_at().   The bits are layout.VOID and layout.WET

#include "blocks/terrain.glsl"

#ifndef MARKED  // whether the map has any marks; a macro in programs that serve one map
uniform bool u_marked;
#define MARKED u_marked
#endif

// The shares of filled voids and of water at a place: bilinear between posts.
vec2 marked_at(vec2 post) {
    ivec2 first = min(ivec2(post), u_last_post - 1), next = first + 1;
    vec2 t = post - vec2(first);
    uvec4 marks = uvec4(
        marks_at(ivec2(first.x, next.y)), marks_at(next), marks_at(ivec2(next.x, first.y)), marks_at(first));
    vec4 weights = vec4((1.0 - t.x) * t.y, t.x * t.y, t.x * (1.0 - t.y), (1.0 - t.x) * (1.0 - t.y));
    return vec2(dot(weights, vec4(notEqual(marks & uint(VOID), uvec4(0u)))),
        dot(weights, vec4(notEqual(marks & uint(WET), uvec4(0u)))));
}
