"""Brushes: from the heights under a brush to new heights, and strokes with undo and redo.

This module needs no window and no OpenGL. A dab is a pure function of the heights around it; its time grows with its
footprint. `Sculptor` passes the new heights to a `Renderer`.

    sculptor = Sculptor(renderer)
    sculptor.begin()                                             # the button goes down
    sculptor.dab(Brush("raise", radius_m=500, strength=20), x, y)  # as often as the pointer moves
    sculptor.end()                                               # the button goes up: the light follows
    sculptor.undo()                                              # the whole stroke
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import reduce
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..basics.boxes import box_sums
from ..basics.exceptions import UsageError
from ..basics.rect import Edit, slices_hull, within
from ..heightmap import MAX_HEIGHT_M, Heightmap

if TYPE_CHECKING:
    from .renderer import Renderer

TOOLS = ("raise", "lower", "smooth", "flatten", "cliff")
SHARES = ("smooth", "flatten")  # tools whose strength is a share, not metres
MOST_BYTES = 256 << 20  # memory for undo and redo
_Touched = tuple[slice, slice, np.ndarray]  # rows and columns of the posts under a brush; column and row of its middle


@dataclass(frozen=True)
class Brush:
    """A tool and its settings.

    Attributes
    ----------
    tool
        One of `TOOLS`. "smooth" moves the ground towards the mean of its neighbourhood, "flatten" towards the height in
        the middle; "cliff" raises the half of the footprint that lies opposite to the direction `azimuth_deg`.
    radius_m
        Radius of the footprint, a circle on the map.
    strength
        Metres in the middle; for `SHARES`: how far the ground moves towards its goal, 0 to 1.
    falloff
        Share of the radius, from the rim inwards, over which the strength fades out: 0 (a hard edge) to 1.
    azimuth_deg
        The direction that a "cliff" faces, clockwise from north.

    Raises
    ------
    UsageError
        A value outside its range.
    """

    tool: str = "raise"
    radius_m: float = 100.0
    strength: float = 1.0
    falloff: float = 1.0
    azimuth_deg: float = 180.0

    def __post_init__(self) -> None:
        if self.tool not in TOOLS:
            raise UsageError(f"tool: expected one of {', '.join(TOOLS)}, got {self.tool!r}")
        if not 0 < self.radius_m < 1e9:
            raise UsageError(f"radius must be more than 0 and less than 1e9 metres, got {self.radius_m:g}")
        if not 0 <= self.strength <= (1.0 if self.tool in SHARES else MAX_HEIGHT_M):
            most = "1" if self.tool in SHARES else f"{MAX_HEIGHT_M:g} metres"
            raise UsageError(f"strength of {self.tool} must be from 0 to {most}, got {self.strength:g}")
        if not 0 <= self.falloff <= 1:
            raise UsageError(f"falloff must be from 0 to 1, got {self.falloff:g}")


def dabs(heightmap: Heightmap, brush: Brush, middles_m: Sequence[tuple[float, float]]) -> Edit | None:
    """New heights after dabs at places in world metres, one after the other; None if no post lies under any dab.

    Voids stay voids. Heights are clipped to ±`MAX_HEIGHT_M`.
    """
    reach = brush.radius_m / np.array(heightmap.spacing_m)
    touched = [each for x_m, y_m in middles_m if (each := _touched(heightmap, reach, x_m, y_m))]
    if not touched:
        return None
    rows = reduce(slices_hull, (rows for rows, _, _ in touched))
    cols = reduce(slices_hull, (cols for _, cols, _ in touched))
    half = np.maximum(1, np.rint(reach / 8)).astype(int)  # columns and rows, half the sides of a box whose mean smooths
    around = _grown(rows, int(half[1]), heightmap.rows), _grown(cols, int(half[0]), heightmap.cols)
    ground = Edit(around[1].start, around[0].start, heightmap.part(*around).copy())
    for each in touched:
        _press(ground, heightmap, brush, half, each)
    return Edit(cols.start, rows.start, ground.part(rows, cols).copy())


def _touched(heightmap: Heightmap, reach: np.ndarray, x_m: float, y_m: float) -> _Touched | None:
    at = np.array([x_m, heightmap.extent_m[1] - y_m]) / np.array(heightmap.spacing_m)
    first = np.clip(np.ceil(at - reach), 0, None).astype(int)
    end = np.clip(np.floor(at + reach) + 1, 0, [heightmap.cols, heightmap.rows]).astype(int)
    if not (first < end).all():
        return None
    return slice(int(first[1]), int(end[1])), slice(int(first[0]), int(end[0])), at


def _press(ground: Edit, heightmap: Heightmap, brush: Brush, half: np.ndarray, touched: _Touched) -> None:
    rows, cols, at = touched
    spacing = heightmap.spacing_m
    east = (np.arange(cols.start, cols.stop) - at[0]) * spacing[0]
    south = (np.arange(rows.start, rows.stop) - at[1])[:, None] * spacing[1]
    weight = brush.strength * _fade(np.hypot(east, south) / brush.radius_m, brush.falloff)
    part = ground.part(rows, cols)
    old = part.astype(np.float64)
    if brush.tool in ("raise", "lower"):
        new = old + weight if brush.tool == "raise" else old - weight
    elif brush.tool == "smooth":
        new = old + weight * (_means(ground, (heightmap.rows, heightmap.cols), rows, cols, half) - old)
    elif brush.tool == "flatten":
        col, row = np.clip(np.rint(at), 0, [heightmap.cols - 1, heightmap.rows - 1]).astype(int)
        new = old + weight * (_level_m(float(old[row - rows.start, col - cols.start]), old) - old)
    else:
        azimuth = math.radians(brush.azimuth_deg)
        new = old + weight * (east * math.sin(azimuth) - south * math.cos(azimuth) < 0)
    with np.errstate(under="ignore"):
        part[:] = np.clip(new, -MAX_HEIGHT_M, MAX_HEIGHT_M).astype(np.float32)


def places(start: tuple[float, float], end: tuple[float, float], step_m: float) -> Iterator[tuple[float, float]]:
    """Places from `start` (excluded) to `end`, at most a step apart, so that a fast pointer leaves no gaps."""
    count = max(1, math.ceil(math.dist(start, end) / step_m))
    for i in range(1, count + 1):
        yield start[0] + (end[0] - start[0]) * i / count, start[1] + (end[1] - start[1]) * i / count


def _fade(distance: np.ndarray, falloff: float) -> np.ndarray:
    """Weight at a distance from the middle, given in radii: 1 in the middle, 0 at the rim, a smooth step between."""
    t = np.clip((1.0 - distance) / max(falloff, 1e-9), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def _level_m(middle_m: float, old: np.ndarray) -> float:
    """Height to flatten to: that of the post in the middle, or the mean if that post is void."""
    known = old[np.isfinite(old)]
    return middle_m if math.isfinite(middle_m) or not known.size else float(known.mean())


def _means(ground: Edit, shape: tuple[int, int], rows: slice, cols: slice, half: np.ndarray) -> np.ndarray:
    """Mean of the known heights in the box around each post. With summed-area tables, large boxes cost no more time."""
    y = np.arange(rows.start - half[1], rows.stop + half[1])
    x = np.arange(cols.start - half[0], cols.stop + half[0])
    inside = ((y >= 0) & (y < shape[0]))[:, None] & ((x >= 0) & (x < shape[1]))
    posts = np.ix_(y.clip(0, shape[0] - 1) - ground.rows.start, x.clip(0, shape[1] - 1) - ground.cols.start)
    part = ground.heights[posts].astype(np.float64)
    known = inside & np.isfinite(part)
    base = float(part[known].mean()) if known.any() else 0.0  # sums of small numbers lose fewer digits
    size = (2 * half[1] + 1, 2 * half[0] + 1)
    totals = box_sums(np.where(known, part - base, 0.0), *size)
    counts = box_sums(known, *size)
    return base + totals / np.maximum(counts, 1.0)


# --- Strokes ----------------------------------------------------------------------------------------------------------


class _Change(NamedTuple):
    """The heights of a rectangle before and after an edit."""

    rows: slice
    cols: slice
    before: np.ndarray
    after: np.ndarray

    @property
    def bytes(self) -> int:
        return self.before.nbytes + self.after.nbytes


@dataclass
class Sculptor:
    """Applies dabs to a map and keeps them as strokes, for undo and redo."""

    surface: Renderer  # only its heightmap, `edit` and `settle` are used
    most_bytes: int = MOST_BYTES  # memory for strokes: the oldest are forgotten first, the last one is always kept
    _done: list[list[_Change]] = field(default_factory=list)
    _undone: list[list[_Change]] = field(default_factory=list)
    _oldest: object = None  # identifies the heights before the first stroke in memory

    @property
    def can_undo(self) -> int:
        return sum(map(bool, self._done))

    @property
    def can_redo(self) -> int:
        return len(self._undone)

    @property
    def land(self) -> object:
        """An object that identifies the heights; None at first. Undo and redo restore it with the heights."""
        return next((stroke[-1] for stroke in reversed(self._done) if stroke), self._oldest)

    @property
    def bytes(self) -> int:
        return sum(change.bytes for stroke in self._done + self._undone for change in stroke)

    def begin(self) -> None:
        """Begin a new stroke; undo takes it back as a whole."""
        if not self._done or self._done[-1]:
            self._done.append([])

    def end(self) -> None:
        """End the stroke and update the light. Dabs, undo and redo do not update it."""
        self.surface.settle()

    def dab(self, brush: Brush, x_m: float, y_m: float) -> Edit | None:
        """Apply a brush at a place in world metres; returns the new heights, or None if no post lies under it."""
        return self.dabs(brush, [(x_m, y_m)])

    def dabs(self, brush: Brush, middles_m: Sequence[tuple[float, float]]) -> Edit | None:
        """Apply a brush at several places in one edit, which is faster if they lie close together."""
        edit = dabs(self.surface.heightmap, brush, middles_m)
        if not edit:
            return None
        if not self._done:
            self.begin()
        rows, cols = edit.rows, edit.cols
        before = self.surface.heightmap.part(rows, cols).copy()
        self.surface.edit(rows, cols, edit.heights, settle=False)
        change = _Change(rows, cols, before, self.surface.heightmap.part(rows, cols).copy())
        self._undone.clear()
        stroke = self._done[-1]
        if stroke and (joined := self._joined(stroke[-1], change)):
            stroke[-1] = joined
        else:
            stroke.append(change)
        while self.bytes > self.most_bytes and len(self._done) > 1:
            self._oldest = next(reversed(self._done.pop(0)), self._oldest)
        return edit

    def undo(self) -> bool:
        """Undo the last stroke; False if there is none."""
        return self._move(self._done, self._undone, "before")

    def redo(self) -> bool:
        """Redo the last stroke that was undone; False if there is none."""
        return self._move(self._undone, self._done, "after")

    def _move(self, source: list[list[_Change]], target: list[list[_Change]], side: str) -> bool:
        while source and not source[-1]:
            source.pop()
        if not source:
            return False
        stroke = source[-1]
        for change in reversed(stroke):  # changes may overlap: the last one is undone first
            self.surface.edit(change.rows, change.cols, getattr(change, side), settle=False)
        target.append(source.pop()[::-1])
        return True

    def _joined(self, old: _Change, new: _Change) -> _Change | None:
        """Both changes as one; None if that saves no memory."""
        rows, cols = slices_hull(old.rows, new.rows), slices_hull(old.cols, new.cols)
        after = self.surface.heightmap.part(rows, cols)
        if 2 * after.nbytes > old.bytes + new.bytes:
            return None
        before = after.copy()
        for change in (new, old):  # where both overlap, keep the older heights as those before the stroke
            before[within(change.rows, rows), within(change.cols, cols)] = change.before
        return _Change(rows, cols, before, after.copy())


def _grown(part: slice, by: int, end: int) -> slice:
    return slice(max(0, part.start - by), min(end, part.stop + by))
