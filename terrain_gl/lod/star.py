"""Whether the tessellator draws patches of 4 × 4 and 8 × 8 segments as stars: then their bounds are known.

All diagonals of a star run toward its middle. If an edge is cut, only the triangles with a leg on it change: each
becomes triangles around its other vertex (docs/guarantee.md, section 3). OpenGL leaves this to the driver. So we draw
stars with all numbers of segments along an edge, and look.
"""

from __future__ import annotations

import moderngl
import numpy as np

from ..gpu import gl, shaders

SEGMENTS = 4, 8  # of each side of a star
_PARTS = 64  # of a side: places are counted in these
_CUTS = 4, 8, 16, 32, 64  # segments that an edge may have
_PATCHES = [(t, a, b) for t in SEGMENTS for b in _CUTS for a in _CUTS]  # glsl/mesh/star.tesc


def draws_stars(ctx: moderngl.Context) -> bool:
    """Whether this driver does so, for every number of segments of an edge."""
    if "draws_stars" not in (ctx.extra or {}):
        expected = [_sorted(star_triangles(t, (max(a, t), max(b, t), max(b, t), max(a, t)))) for t, a, b in _PATCHES]
        drawn = _drawn(ctx, sum(map(len, expected)))
        ctx.extra = (ctx.extra or {}) | {"draws_stars": np.array_equal(np.concatenate(expected), drawn)}
    return bool(ctx.extra["draws_stars"])


def star_triangles(segments: int, edges: tuple[int, int, int, int]) -> np.ndarray:
    """Triangles of a star: (n, 3, 2) columns and rows in 64ths of a side.

    Parameters
    ----------
    segments
        Of each side.
    edges
        Segments of the edges west, north, east and south: at least as many.
    """
    west, north, east, south = edges
    quarter_turn = np.array([[0, 1], [-1, 0]])  # (x, y) → (−y, x): north becomes east
    quarters = (_quarter(segments, along) - _PARTS // 2 for along in (north, east, south, west))
    turned = [quarter @ np.linalg.matrix_power(quarter_turn, k) for k, quarter in enumerate(quarters)]
    return np.concatenate(turned) + _PARTS // 2


def _quarter(segments: int, along_edge: int) -> np.ndarray:
    """The triangles between the northern edge and the middle, row after row."""
    found, cut, middle = [], along_edge // segments, segments // 2
    for row in range(middle):
        parts = cut if row == 0 else 1
        for k in range(row, segments - row):  # triangles with a leg on the row's northern side
            apex = (k + 1 if k < middle else k, row + 1)
            found += [[(k + i / parts, row), (k + (i + 1) / parts, row), apex] for i in range(parts)]
        for k in range(row + 1, segments - row - 1):  # and on its southern side
            found.append([(k, row + 1), (k + 1, row + 1), (k if k < middle else k + 1, row)])
    return np.rint(np.array(found) * (_PARTS / segments)).astype(int)


def _sorted(triangles: np.ndarray) -> np.ndarray:
    """Triangles as three numbers each, in an order that depends on their places alone."""
    vertices = np.sort(triangles[..., 1] * (_PARTS + 1) + triangles[..., 0], 1)
    return vertices[np.lexsort(vertices.T)]


def _drawn(ctx: moderngl.Context, count: int) -> np.ndarray:
    """What the driver draws, patch after patch; more or fewer than `count` triangles give an empty array."""
    program = shaders.program(
        ctx,
        vertex="mesh/star.vert",
        tess_control="mesh/star.tesc",
        tess_evaluation="mesh/star.tese",
        varyings=["v_place"],
    )
    vao, out = ctx.vertex_array(program, []), ctx.buffer(reserve=2 * count * 3 * 12)
    commands = ctx.buffer(np.array([len(_PATCHES), 1, 0, 0, 0], "u4").tobytes())
    ctx.patch_vertices = 1
    try:
        if gl.capture(ctx, program, vao, out, commands, 1) != count:
            return np.zeros(0)
        places = np.frombuffer(out.read(count * 36), "f4").reshape(count, 3, 3)
    finally:
        for resource in (commands, vao, out, program):
            resource.release()
    triangles, patch = np.rint(places[..., :2] * _PARTS).astype(int), places[:, 0, 2]
    return np.concatenate([_sorted(triangles[patch == k]) for k in range(len(_PATCHES))])
