"""Whether the tessellator draws patches of 4 × 4 and 8 × 8 segments as stars: then their bounds are known.

All diagonals of a star run toward its middle. If an edge is cut, only the triangles with a leg on it change: each
becomes triangles around its other vertex (docs/guarantee.md, section 3). OpenGL leaves this to the driver. So we draw
stars with all numbers of segments along an edge, and look.
"""

from __future__ import annotations

import moderngl
import numpy as np

from ..gpu import gl, shaders

PATCHES = 50  # glsl/mesh/star.tesc: 25 of each kind
MOST_TRIANGLES = 8192


def draws_stars(ctx: moderngl.Context) -> bool:
    """Whether this driver does so, for every number of segments of an edge."""
    if "draws_stars" not in (ctx.extra or {}):
        places, patch = _drawn(ctx)
        segments = np.where(patch < PATCHES // 2, 4, 8)[:, None, None]
        ctx.extra = (ctx.extra or {}) | {"draws_stars": are_of_stars(places * segments, segments)}
    return bool(ctx.extra["draws_stars"])


def star_defines(ctx: moderngl.Context) -> dict[str, int]:
    """What ring shaders are told of it."""
    return {"STARS": 1} if draws_stars(ctx) else {}


def are_of_stars(places: np.ndarray, segments: np.ndarray) -> bool:
    """Whether triangles that cover patches without gaps are those of stars.

    Each must lie in one half of a cell, cut toward the patch's middle. Its vertices must be corners of cells, or lie on
    the patch's edge.

    Parameters
    ----------
    places
        (n, 3, 2) columns and rows, in cells from the patch's corner.
    segments
        Cells along the patch's side: (n, 1, 1) or one number.
    """
    places = np.where(
        places.mean(1, keepdims=True) > segments / 2, segments - places, places
    )  # from the nearest corner
    in_cell = places - np.floor(places.mean(1, keepdims=True))
    after = in_cell[..., 0] - in_cell[..., 1]
    in_half = np.all((in_cell >= 0) & (in_cell <= 1), (1, 2)) & (np.all(after >= 0, 1) | np.all(after <= 0, 1))
    is_known = np.all(in_cell % 1 == 0, 2) | np.any(places == 0, 2)
    return len(places) > 0 and bool(np.all(in_half) and np.all(is_known))


def _drawn(ctx: moderngl.Context) -> tuple[np.ndarray, np.ndarray]:
    """Triangles in parts of their patch's side, (n, 3, 2), and the patch of each."""
    stages = {"vertex": "shade/screen.vert", "tess_control": "mesh/star.tesc", "tess_evaluation": "mesh/star.tese"}
    program = shaders.program(ctx, **stages, varyings=["v_place"])  # type: ignore[arg-type]
    vao = ctx.vertex_array(program, [])
    out = ctx.buffer(reserve=MOST_TRIANGLES * 36)
    ctx.patch_vertices = 1
    count = gl.capture(ctx, program, vao, out, [(0, PATCHES)])
    found = np.frombuffer(out.read(count * 36), "f4").reshape(count, 3, 3)
    for resource in (vao, out, program):
        resource.release()
    return np.rint(found[..., :2] * 64) / 64, found[:, 0, 2]
