"""Check the certificate's assumptions about a driver's tessellator: capture patches with the shaders of the mesh.

OpenGL does not say how a driver joins the vertices on a patch's edge with the vertices inside. The bound of a cell
whose edges are cut (docs/guarantee.md, section 3) holds if each triangle stays within one cell, and has new vertices on
at most one edge. A fan needs its centre in every triangle. All numbers of segments that the mesh uses are tried.
"""

from collections.abc import Iterator

import moderngl
import numpy as np

from . import layout
from .passes import DrawPass, Feed, Resources

SIDE = 64  # places along a side of a patch: the most segments of an edge
COUNTS = (2, 4, 8, 16, 32, 64)  # segments inside a patch with strips; its edges have as many, or more
FANS = ((1, 1, 1, 1, 2), (2, 1, 2, 1, 2))  # whole edges, and edges split in their middle


def strips() -> Iterator[tuple[int, ...]]:
    """Patches with each number of segments inside, and with each possible number on each edge.

    Segments of the edges u = 0, v = 0, u = 1, v = 1, and inside. Neighbouring edges of a patch differ.
    """
    for first, inside in enumerate(COUNTS):
        edges = COUNTS[first:]
        for i in range(len(edges)):
            yield (*(edges[(i + k) % len(edges)] for k in range(4)), inside)


PATCHES = (*strips(), *FANS)


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
        if set(along[at == SIDE * (edge // 2)].tolist()) != set(range(0, SIDE + 1, SIDE // segments)):
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
    """Triangles (n, 3, 3): column and row of each vertex in its patch, and the number of the patch."""
    stages = {"vertex": "mesh/patch.vert", "tess_control": "mesh/patch.tesc", "tess_evaluation": "mesh/patch.tese"}
    capture = DrawPass(ctx, stages, {"TO": "CAPTURE"}, varyings=("v_vertex",))
    *edges_log2, inside_log2 = np.log2(patches).astype("u4").T
    side_log2 = SIDE.bit_length() - 1
    records = np.zeros(len(patches), layout.PATCH)
    records["corner"][:, 0] = 2 * SIDE * np.arange(len(patches))
    records["shape"] = side_log2 | side_log2 - inside_log2 + 16 << 5
    for edge, segments_log2 in enumerate(edges_log2):
        records["shape"] |= segments_log2 << 11 + 3 * edge
    land = np.zeros((), layout.TERRAIN)
    land["last_post"] = 2 * SIDE * len(patches), SIDE
    terrain, fed = ctx.buffer(land.tobytes()), ctx.buffer(records.tobytes())
    view, flat = ctx.buffer(bytes(layout.VIEW.itemsize)), ctx.texture((1, 1), 1, bytes(4), dtype="f4")
    draws = ctx.buffer(np.array([len(patches), 1, 0, 0, 0], "u4").tobytes())
    out = ctx.buffer(reserve=3 * 12 * sum(2 * inside**2 + 4 * SIDE for *_, inside in patches))
    feed = Feed([(fed, "4i4", "in_patch")], mode=moderngl.PATCHES)
    resources: Resources = {"Terrain": terrain, "View": view, "u_heights": flat}
    triangles = capture.capture(out, resources, {}, feed, draws, 1)
    found = np.frombuffer(out.read(triangles * 3 * 12), "f4").reshape(-1, 3, 3).astype("f8")[:, ::-1]
    for resource in (capture, terrain, view, flat, fed, draws, out):
        resource.release()
    found[..., 2] = found[..., :1].min(1) // (2 * SIDE)
    found[..., 0] -= 2 * SIDE * found[..., 2]
    return found
