"""Lesson 8: tessellation hardware.

A patch is a square of the map. Its north-west post is (column, row), its side is in posts. In the patch, u runs from 0
in the west to 1 in the east, and v from 0 in the north to 1 in the south: gl_TessCoord.xy.
"""


def shaders():
    """The two shaders as texts."""
    return {"control": CONTROL, "evaluation": EVALUATION}


# 8.1 The control shader says how many segments each edge and the inside have.
#   gl_TessLevelOuter[0], [1], [2], [3] are the edges u = 0, v = 0, u = 1, v = 1.
# v_edges holds the segments of the edges in the order north, east, south, west. A patch that is not drawn gets level 0.
CONTROL = """
#version 410
layout(vertices = 1) out;
in ivec4 v_square[];  // column, row, side; 1 if the patch is drawn, else 0
in ivec4 v_edges[];   // segments along north, east, south, west
in int v_inner[];     // segments inside, in both directions
patch out ivec4 p_square;

void main() {
    p_square = v_square[0];
    // write this
}
"""

# 8.2 The evaluation shader places one vertex. Every vertex stands on a post: the side is a multiple of all segments.
#   v_place is the post's column and row, and its height. Posts past the map's last post are clamped to it; the number
#   of columns and rows is textureSize(u_heights, 0).
#   Triangles are counter-clockwise seen from above: rows run to the south, so think about cw and ccw.
EVALUATION = """
#version 410
// write this
patch in ivec4 p_square;
uniform sampler2D u_heights;  // texel (column, row); texelFetch(u_heights, ivec2(column, row), 0).r
out vec3 v_place;

void main() {
    gl_Position = vec4(0.0);
    // write this
}
"""
