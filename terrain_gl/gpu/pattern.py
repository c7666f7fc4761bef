"""Check the certificate's assumptions about a driver's tessellator, on the captured triangles of a few patches.

OpenGL does not say how a driver joins the vertices on a patch's edge with the vertices inside. The bound of a cell
whose edges are cut (docs/guarantee.md, section 3) holds if each triangle stays within one cell, and has new vertices on
at most one edge. A fan needs its centre in every triangle.
"""

from collections.abc import Iterator

import moderngl
import numpy as np

from . import gl, shaders

SIDE = 64  # places along a side of a patch: the most segments of an edge
PATCHES = (  # segments of the edges u = 0, v = 0, u = 1, v = 1, and inside
    (2, 2, 2, 2, 2),
    (4, 4, 4, 4, 4),
    (4, 2, 8, 16, 2),  # cut edges that meet in a corner
    (64, 4, 4, 32, 4),
    (8, 16, 32, 64, 8),
    (8, 8, 64, 8, 8),
    (1, 1, 1, 1, 2),  # fans: whole edges, and edges split in their middle
    (2, 1, 2, 1, 2),
)


def wrong_pattern(ctx: moderngl.Context) -> Iterator[str]:
    """Tessellate PATCHES on the GPU; yields each violation of an assumption, in a few words."""
    places = _captured(ctx, PATCHES)
    for number, (*edges, inside) in enumerate(PATCHES):
        wrong = next(faults_of(places[places[:, 0, 2] == number, :, :2], edges, inside), None)
        if wrong:
            yield f"this driver tessellates a patch of {inside} segments with {wrong}"
            return


def faults_of(triangles: np.ndarray, edges: list[int], inside: int) -> Iterator[str]:
    """The faults of a patch's triangles, (n, 3, 2) places in 64ths of its side."""
    (ax, ay), (bx, by), (cx, cy) = np.moveaxis(triangles, 0, -1)
    areas = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)  # twice the areas
    if (areas < 0).any() or areas.sum() != 2 * SIDE**2:
        yield "triangles that do not cover it once"
    if len(triangles) != 2 * (inside - 2) ** 2 + sum(edges) + 4 * (inside - 2):
        yield "another number of triangles"
    for edge, segments in enumerate(edges):
        at, along = triangles[..., edge % 2].ravel(), triangles[..., 1 - edge % 2].ravel()
        if set(along[at == SIDE * (edge // 2)]) != set(range(0, SIDE + 1, SIDE // segments)):
            yield "other vertices on its edges"
            break
    drawn, cell = triangles[areas > 0], SIDE // inside
    if min(edges) < inside:  # a fan
        if not (drawn == SIDE // 2).all(-1).any(-1).all():
            yield "triangles that do not reach the centre"
        return
    if (np.floor(drawn.min(1) / cell) + 1 < np.ceil(drawn.max(1) / cell)).any():
        yield "triangles that leave a cell"
    is_new = [(drawn[..., e % 2] == SIDE * (e // 2)) & (drawn[..., 1 - e % 2] % cell != 0) for e in range(4)]
    if (np.any(is_new, 2).sum(0) > 1).any():
        yield "triangles between two cut edges"


def _captured(ctx: moderngl.Context, patches: tuple[tuple[int, ...], ...]) -> np.ndarray:
    """Triangles (n, 3, 3): both coordinates of each vertex, and the number of its patch."""
    program = shaders.program(
        ctx,
        vertex="driver/pattern.vert",
        tess_control="driver/pattern.tesc",
        tess_evaluation="driver/pattern.tese",
        varyings=("v_place",),
    )
    levels = np.column_stack([patches, range(len(patches))]).astype("f4")
    fed = ctx.buffer(levels.tobytes())
    vao = ctx.vertex_array(program, [(fed, "4f 2f", "in_edges", "in_inside")])
    out = ctx.buffer(reserve=1 << 16)
    ctx.patch_vertices = 1
    triangles = gl.capture(ctx, program, vao, out, [(0, len(patches))])
    found = np.frombuffer(out.read(triangles * 3 * 12), "f4").reshape(-1, 3, 3).astype("f8")
    for resource in (vao, program, fed, out):
        resource.release()
    return found
