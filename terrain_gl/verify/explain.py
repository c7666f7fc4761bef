"""Why a patch is drawn as it is: its possible levels, with their errors in metres and on the screen.

The errors come from the same tables and the same shader code that choose the level: glsl/lod/rings/explain.comp.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import moderngl
import numpy as np

from ..gpu import layout
from ..gpu.passes import ComputePass
from ..lod import RingsSelector, Selection
from ..lod.hiding import ridge_before
from ..lod.patches import OwnEdges

_EXPLAIN = "lod/rings/explain.comp"
_LOOKUP = np.dtype(
    [("tiles", "4i4"), ("corners", "4u4"), ("class", "i4"), ("level", "i4"), ("above", "i4"), ("limit_m", "f4")]
)
_ANSWER = np.dtype(
    [("projection", "4f4"), ("range_m", "4f4"), ("choice", "4f4", layout.SIZES), ("lookup", _LOOKUP, layout.SIZES)]
)


@dataclass(frozen=True)
class Lookup:
    """The look-up, by four fetches, that tells whether a square is within the tolerance.

    Attributes
    ----------
    level, error_class
        The table that was read: for quads of 2^level posts a side, and for this class of errors.
    limit_m
        The limit of the class in metres. Of all limits that are within the tolerance, it is the largest.
    tiles
        The box: first column and row, then the column and row after the last. A tile is 2 × 2 quads, or 4 × 4 cells.
    corners
        The table's entries at the box's corners, modulo 256: north-west, north-east, south-west, south-east.
    above
        Number of tiles of the box with an error above the limit; 0 if these quads suffice.
    """

    level: int
    error_class: int
    limit_m: float
    tiles: tuple[int, int, int, int]
    corners: tuple[int, int, int, int]
    above: int

    @property
    def count(self) -> int:
        """Number of tiles in the box."""
        return (self.tiles[2] - self.tiles[0]) * (self.tiles[3] - self.tiles[1])


@dataclass(frozen=True)
class Choice:
    """One way to draw a square of the map.

    Attributes
    ----------
    segments
        Segments a side.
    step
        Posts between vertices; less than 1 where cells of the map are cut.
    max_m, rms_m
        Bounds of the error in metres of height: the largest, and the root mean square.
    px
        Bound of the error on the screen, in the requested metric.
    lookup
        The look-up that decides whether this choice is enough; None if there is none, as for a store.
    """

    segments: int
    step: float
    max_m: float
    rms_m: float
    px: float
    lookup: Lookup | None = None


@dataclass(frozen=True)
class Explanation:
    """A patch, and its alternatives.

    Attributes
    ----------
    corner, side
        Column and row of its north-west post, and posts along a side.
    level
        Level of the quads: 2^level posts a side; negative where cells of the map are cut.
    chosen
        How the patch is drawn.
    choices
        The ways to draw it, coarsest first; `chosen` is one of them.
    range_m
        Lowest and highest height of its bounding box.
    nearest_m
        View depth of the nearest corner of that box.
    px_per_m
        The most pixels that a metre of height covers there.
    in_picture
        Whether a part of the patch is in the picture; outside it, any level is allowed.
    tolerance_px, metric
        The requested tolerance and its metric.
    bound_px
        The bound of the patch together with its cut edges.
    hidden_by
        If the patch is hidden, and so not drawn: the ridge in front of it, x and y in world metres.
    joined
        The choice with four patches of this size joined to one, and vertices twice as far apart; None if not known.
    """

    corner: tuple[int, int]
    side: int
    level: int
    chosen: Choice
    choices: tuple[Choice, ...]
    range_m: tuple[float, float]
    nearest_m: float
    px_per_m: float
    in_picture: bool
    tolerance_px: float
    metric: str
    bound_px: float
    hidden_by: tuple[float, float] | None = None
    joined: Choice | None = None


class PatchExplainer:
    """Explains patches."""

    def __init__(self, ctx: moderngl.Context, defines: Mapping[str, object]) -> None:
        self.ctx = ctx
        self._kernel = ComputePass(ctx, _EXPLAIN, defines)
        self._answer = self.ctx.buffer(reserve=_ANSWER.itemsize)

    def explain(
        self, selection: Selection, post: tuple[float, float], tolerance_px: float, metric: str
    ) -> Explanation | None:
        """Explain the patch over a place of the map, given as column and row; None if there is no explanation.

        The view must be that of the selection.
        """
        surface = selection.surface
        if isinstance(surface, OwnEdges):
            surface = surface.agreed
        if not isinstance(surface, RingsSelector):
            return None
        patches = surface.chosen(selection)
        at = _over(patches, post)
        if at is None:
            return None
        corner = int(patches.corner[at, 0]), int(patches.corner[at, 1])
        side_log2 = int(patches.side_log2[at])
        step_log2 = int(patches.step_log2[at])
        answer = self._ask(surface, corner, side_log2)
        choices = _choices(answer, side_log2)
        around = corner[0] & -2 << side_log2, corner[1] & -2 << side_log2
        four = _choices(self._ask(surface, around, side_log2 + 1), side_log2 + 1)
        joined = next((each for each in four if each.step == 2.0 ** (step_log2 + 1)), None)
        hidden_by = _ridge(surface, selection, post) if at >= selection.patches else None
        chosen = next((choice for choice in choices if choice.segments == 1 << side_log2 - step_log2), None)
        if chosen is None:
            return None
        bound_px = float(patches.bound_px[at])
        about = corner, 1 << side_log2, step_log2, chosen, choices
        seen = _seen(answer, surface.view.focal_px)
        return Explanation(*about, *seen, tolerance_px, metric, bound_px, hidden_by, joined)

    def release(self) -> None:
        """Release GPU resources."""
        for resource in (self._kernel, self._answer):
            resource.release()

    def _ask(self, surface: RingsSelector, low: tuple[int, int], side_log2: int) -> np.ndarray:
        read = {name: resource for name, resource in surface.of_passes.items() if name in self._kernel.declares}
        self._kernel.run((1, 1, 1), read | {"Answer": self._answer}, {"low": low, "side_log2": side_log2})
        self.ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT | moderngl.BUFFER_UPDATE_BARRIER_BIT)
        return np.frombuffer(self._answer.read(), _ANSWER)[0]


def _over(patches: layout.Patches, post: tuple[float, float]) -> int | None:
    """Index of the first patch that holds a place."""
    offset = np.asarray(post) - patches.corner
    found = np.flatnonzero(((offset >= 0) & (offset <= patches.size)).all(1))
    return int(found[0]) if len(found) else None


def _ridge(surface: RingsSelector, selection: Selection, post: tuple[float, float]) -> tuple[float, float]:
    """World metres of the ridge that hides a column and row."""
    camera = selection.hiding.camera
    assert camera
    heightmap = surface.terrain.heightmap
    east, north = heightmap.spacing_m
    place = post[0] * east, (heightmap.rows - 1 - post[1]) * north
    x, y = ridge_before(surface.horizon_of(selection), heightmap, camera, *place)
    true_east, true_north = heightmap.ground_spacing_m  # with exaggerated relief, `spacing_m` is smaller
    return x * true_east / east, y * true_north / north


def _seen(answer: np.ndarray, focal_px: float) -> tuple[tuple[float, float], float, float, bool]:
    """Of a box: range of heights, smallest depth, pixels for a metre, whether a part of it is in the picture."""
    nearest_m, stretch = (float(v) for v in answer["projection"][:2])
    low_m, high_m = (float(v) for v in answer["range_m"][:2])
    return (low_m, high_m), nearest_m, focal_px * stretch / nearest_m, not answer["projection"][3]


def _choice(segments: int, step: float, errors: np.ndarray, lookup: Lookup | None = None) -> Choice:
    max_m, rms_m, px = (float(v) for v in errors[:3])
    return Choice(segments, step, max_m, rms_m, px, lookup)


def _choices(answer: np.ndarray, side_log2: int) -> tuple[Choice, ...]:
    """The choices for a square, coarsest first."""
    return tuple(
        _choice(1 << k, 2.0 ** (side_log2 - k), each, _lookup(answer["lookup"][k]))
        for k, each in enumerate(answer["choice"])
        if each[3]
    )


def _lookup(found: np.void) -> Lookup | None:
    """The look-up of one choice, from its record."""
    if found["class"] < 0:
        return None
    x0, y0, x1, y1 = (int(v) for v in found["tiles"])
    a, b, c, d = (int(v) for v in found["corners"])
    place = int(found["level"]), int(found["class"]), float(found["limit_m"])
    return Lookup(*place, (x0, y0, x1, y1), (a, b, c, d), int(found["above"]))
