"""Lines of sight over the truth: whether one place sees another, and which place hides it. Plain numpy.

The sight line from a to b is straight. The land under it is drawn lower, because the Earth is round: by the drop of
`Camera.bend_per_m`, with a as the eye. In each cell that the line crosses, the height of the line over the land is a
parabola: the land is bilinear, and the drop is a plane within a cell. So its smallest value is at one of two ends, or
at the parabola's top. b is seen if no cell has a value below 0.

All lines are followed at once, from the whole map to single cells. The portion of a line over a block of 2^n x 2^n
cells is split where it crosses the middle of the block. Portions that cannot matter are dropped: where the line is
higher over the highest post of the block than a place of the line that is known to be low.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .basics.exceptions import UsageError
from .readers.georeference import WGS84, Georeference

CURVATURES = ("auto", "on", "off")
FROM_M = 50e3  # "auto" draws a map flat if its longer side is shorter than this
GRAZING_M = 1e-7  # a line that is no deeper in the land than this passes it: both ends may stand on the ground
AT_ONCE = 1 << 19  # crossings of lines with cells that are followed at once
SMALLEST = 2  # blocks of at least 2^2 x 2^2 cells have a highest post; smaller ones cost as much as they save


@dataclass(frozen=True)
class Sight:
    """What lines of sight meet. For one pair of places it is true if they see each other.

    Attributes
    ----------
    seen
        (...) bool.
    hidden_by
        (..., 3) world metres: the first place of the land that hides b from a; NaN if b is seen.
    clearance_m
        (...) metres: the smallest height of the line over the land. Below 0 if b is hidden; infinite if the line
        crosses no land.
    """

    seen: np.ndarray
    hidden_by: np.ndarray
    clearance_m: np.ndarray

    def __bool__(self) -> bool:
        return bool(self.seen)


def bend_per_m(georeference: Georeference | None, longest_m: float, curvature: str, refraction: float) -> float:
    """1 / 2R, with the radius in effect, for one of `CURVATURES`; 0 if the map is drawn flat.

    "auto" is "on" for a map with a coordinate system whose longer side is at least `FROM_M`, and at most the radius.
    On a larger map, such as that of a whole planet, r² / 2R is far from the true drop.
    """
    if curvature not in CURVATURES:
        raise UsageError(f"curvature: expected one of {', '.join(CURVATURES)}, got {curvature!r}")
    if not 0 <= refraction < 1:
        raise UsageError(f"refraction must be from 0 on and below 1, got {refraction:g}")
    radius_m = _body_radius_m(georeference)
    is_round = georeference is not None and georeference.crs is not None and FROM_M <= longest_m <= radius_m
    if curvature == "off" or (curvature == "auto" and not is_round):
        return 0.0
    return (1 - refraction) / (2 * radius_m)


def _body_radius_m(georeference: Georeference | None) -> float:
    """The semi-major axis of the body that the map is of; the Earth's if its coordinate system does not give one."""
    text = str(georeference.crs) if georeference else ""
    found = re.search(r'(?:SPHEROID|ELLIPSOID)\["[^"]*",\s*([\d.]+)', text)
    return float(found[1]) if found and float(found[1]) > 0 else WGS84[0]


def lines_of_sight(
    heights: np.ndarray, spacing_m: tuple[float, float], a: ArrayLike, b: ArrayLike, bend: float
) -> Sight:
    """Follow the lines from places a to places b, world metres (..., 3), over posts (rows, cols).

    Voids and the world around the map hide nothing.
    """
    a, b = (_places(name, each) for name, each in (("a", a), ("b", b)))
    try:
        a, b = np.broadcast_arrays(a, b)
    except ValueError:
        raise UsageError(f"expected as many places a as b, got {a.shape} and {b.shape}") from None
    shape = a.shape[:-1]
    a, b = a.reshape(-1, 3), b.reshape(-1, 3)
    clearance_m = np.full(len(a), np.inf)
    hidden_by = np.full((len(a), 3), np.nan)
    for some, lines in _portions(heights, spacing_m, a, b, bend):
        clearance_m[some], hidden_by[some] = lines.lowest()
    seen = clearance_m >= -GRAZING_M
    return Sight(seen.reshape(shape)[()], hidden_by.reshape(*shape, 3), clearance_m.reshape(shape)[()])


def seen_from(
    heights: np.ndarray, spacing_m: tuple[float, float], a: ArrayLike, b: np.ndarray, bend: float
) -> np.ndarray:
    """Which places b (n, 3) a place a sees; faster than `lines_of_sight`, which also finds the lowest place."""
    a = np.broadcast_to(_places("a", a), b.shape)
    seen = np.ones(len(b), bool)
    for some, lines in _portions(heights, spacing_m, a, b, bend):
        seen[some] = lines.are_free()
    return seen


def _places(name: str, given: ArrayLike) -> np.ndarray:
    places = np.asarray(given, np.float64)
    if places.shape[-1:] != (3,):
        raise UsageError(f"{name}: expected places X,Y,Z in metres, an array (..., 3), got shape {places.shape}")
    if not np.isfinite(places).all():
        raise UsageError(f"{name}: a place is not a finite number; height_at is NaN off the map and over voids")
    return places


def _portions(
    heights: np.ndarray, spacing_m: tuple[float, float], a: np.ndarray, b: np.ndarray, bend: float
) -> Iterator[tuple[slice, _Lines]]:
    """Lines that together cross about `AT_ONCE` cells, with their place among all."""
    crossed = np.cumsum(np.abs((b - a)[:, :2] / spacing_m).sum(1) + 3)
    pays = len(a) > 0 and crossed[-1] > heights.shape[0] * heights.shape[1] / 4
    highest = _highest(heights) if pays and isinstance(heights, np.ndarray) else []  # a store is not read as a whole
    first = 0
    while first < len(a):
        before = crossed[first - 1] if first else 0.0
        end = max(first + 1, int(np.searchsorted(crossed, before + AT_ONCE)))
        yield slice(first, end), _Lines(heights, spacing_m, a[first:end], b[first:end], bend, highest)
        first = end


def _highest(heights: np.ndarray) -> list[np.ndarray]:
    """The highest post of each block of 2^n x 2^n cells, n from `SMALLEST` on; minus infinity where all are voids."""
    side = 1 << SMALLEST
    rows, cols = (-(-(n - 1) // side) for n in heights.shape)
    padded = np.full((rows * side + 1, cols * side + 1), -np.inf, heights.dtype)
    padded[: heights.shape[0], : heights.shape[1]] = np.where(np.isnan(heights), -np.inf, heights)
    strips = np.maximum(padded[:-1].reshape(rows, side, -1).max(1), padded[side::side])
    found = [np.maximum(strips[:, :-1].reshape(rows, cols, side).max(2), strips[:, side::side])]
    while max(found[-1].shape) > 1:
        rows, cols = (-(-n // 2) for n in found[-1].shape)
        padded = np.full((2 * rows, 2 * cols), -np.inf, heights.dtype)
        padded[: found[-1].shape[0], : found[-1].shape[1]] = found[-1]
        found.append(padded.reshape(rows, 2, cols, 2).max((1, 3)))
    return found


class _Portion(NamedTuple):
    """Portions of lines: the number of the line, and the shares of the line at both ends."""

    line: np.ndarray
    first: np.ndarray
    end: np.ndarray

    def only(self, which: np.ndarray) -> _Portion:
        return _Portion(self.line[which], self.first[which], self.end[which])


Note = Callable[[np.ndarray, np.ndarray, np.ndarray], None]  # lines, shares, and the height over the land there
Matters = Callable[[_Portion, np.ndarray], np.ndarray]  # portions, and a bound of their heights over the land


class _Lines:
    """Lines from a to b (n, 3) over posts; `highest` is empty, or what `_highest` returns."""

    def __init__(
        self,
        heights: np.ndarray,
        spacing_m: tuple[float, float],
        a: np.ndarray,
        b: np.ndarray,
        bend: float,
        highest: Sequence[np.ndarray],
    ) -> None:
        self.heights, self.spacing_m, self.a, self.b, self.bend, self.highest = heights, spacing_m, a, b, bend, highest
        self.last = (heights.shape[1] - 1, heights.shape[0] - 1)
        rows = heights.shape[0] - 1
        self.start, end = ((p[:, 0] / spacing_m[0], rows - p[:, 1] / spacing_m[1]) for p in (a, b))
        self.step = tuple(stop - start for start, stop in zip(self.start, end, strict=True))
        self.length2_m = (self.step[0] * spacing_m[0]) ** 2 + (self.step[1] * spacing_m[1]) ** 2
        u, v = (stop - np.clip(np.floor(stop), 0, last - 1) for stop, last in zip(end, self.last, strict=True))
        self.fall = b[:, 2] - a[:, 2] - bend * (self.length2_m + self._bulge_m(u, v))

    def lowest(self) -> tuple[np.ndarray, np.ndarray]:
        """The smallest height of each line over the land, and the first place that hides b; NaN if b is seen."""
        least = np.full(len(self.a), np.inf)  # known to be as low, here
        below = np.full(len(self.a), np.inf)  # the share of the first place that is known to be in the land

        def note(line: np.ndarray, share: np.ndarray, clearance_m: np.ndarray) -> None:
            np.minimum.at(least, line, clearance_m)
            deep = clearance_m < -GRAZING_M
            np.minimum.at(below, line[deep], share[deep])

        def matters(portion: _Portion, least_m: np.ndarray) -> np.ndarray:
            first = (least_m < -GRAZING_M) & (portion.first <= below[portion.line])
            return (least_m < least[portion.line]) | first

        cells = self._followed(note, matters)
        q, low, land = self._parabolas(cells)
        np.minimum.at(least, cells.line, low)
        hidden_by = np.full((len(self.a), 3), np.nan)
        deep = np.flatnonzero(low < -GRAZING_M)
        if len(deep):
            order = deep[np.lexsort((cells.first[deep], cells.line[deep]))]
            line, at = np.unique(cells.line[order], return_index=True)
            first = order[at]
            c0, c1, c2 = (c[first] for c in q)
            root = -c1 + np.sqrt(np.maximum(c1**2 - 4 * c0 * c2, 0.0))  # the first zero of the parabola is 2 c0 / root
            t = np.where(c0 > 0, np.clip(2 * c0 / np.where(root > 0, root, 1.0), 0.0, 1.0), 0.0)
            along = (cells.first[first] + t * (cells.end - cells.first)[first])[:, None]
            hidden_by[line, :2] = self.a[line, :2] + along * (self.b - self.a)[line, :2]
            hidden_by[line, 2] = land[0][first] + t * land[1][first] - t**2 * c2
        return least, hidden_by

    def are_free(self) -> np.ndarray:
        """Whether no land is in the way of each line."""
        free = np.ones(len(self.a), bool)

        def note(line: np.ndarray, share: np.ndarray, clearance_m: np.ndarray) -> None:
            free[line[clearance_m < -GRAZING_M]] = False

        def matters(portion: _Portion, least_m: np.ndarray) -> np.ndarray:
            return free[portion.line] & (least_m < -GRAZING_M)

        cells = self._followed(note, matters)
        low = self._parabolas(cells)[1]
        free[cells.line[low < -GRAZING_M]] = False
        return free

    def _followed(self, note: Note, matters: Matters) -> _Portion:
        """The portions of the lines in single cells that matter."""
        portion = self._over_map()
        level = max(*self.last, 1).bit_length()
        while level > 0:
            level -= 1
            portion = self._split(portion, level)
            if not self.highest or level < SMALLEST:
                continue
            col, row = self._cells(portion)
            block = self.highest[level - SMALLEST][row >> level, col >> level]
            line = portion.line
            ends = (self.a[line, 2] + share * self.fall[line] for share in (portion.first, portion.end))
            least_m = np.minimum(*ends) + self.bend * self.length2_m[line] * portion.first**2 - block
            middle = 0.5 * (portion.first + portion.end)
            low = least_m < np.inf
            note(line[low], middle[low], self._clearance_m(portion.only(low), middle[low]))
            portion = portion.only(matters(portion, least_m))
        return portion

    def _over_map(self) -> _Portion:
        """The portion of each line over the map."""
        first, end = np.zeros(len(self.a)), np.ones(len(self.a))
        for start, step, last in zip(self.start, self.step, self.last, strict=True):
            moves = step != 0
            shares = [(rim - start) / np.where(moves, step, 1.0) for rim in (0.0, float(last))]
            inside = (start >= 0) & (start <= last)
            first = np.where(moves, np.maximum(first, np.minimum(*shares)), np.where(inside, first, 1.0))
            end = np.where(moves, np.minimum(end, np.maximum(*shares)), np.where(inside, end, 0.0))
        touching = np.minimum(first, end)  # at one place, or not at all
        return _Portion(np.arange(len(self.a)), touching, end).only(end >= first - 1e-12)

    def _cells(self, portion: _Portion) -> tuple[np.ndarray, np.ndarray]:
        """Column and row of the cell under the middle of each portion."""
        middle = 0.5 * (portion.first + portion.end)
        col, row = (
            np.clip(np.floor(start[portion.line] + middle * step[portion.line]), 0, last - 1).astype(np.int64)
            for start, step, last in zip(self.start, self.step, self.last, strict=True)
        )
        return col, row

    def _split(self, portion: _Portion, level: int) -> _Portion:
        """Split portions in blocks of 2^(level + 1) cells a side where they cross the middle of the block."""
        cuts = []
        for cell, start, step in zip(self._cells(portion), self.start, self.step, strict=True):
            middle = ((cell >> (level + 1)) * 2 + 1) << level
            moves = step[portion.line]
            share = (middle - start[portion.line]) / np.where(moves != 0, moves, 1.0)
            cuts.append(np.where(moves != 0, np.clip(share, portion.first, portion.end), portion.first))
        ends = np.stack([portion.first, np.minimum(*cuts), np.maximum(*cuts), portion.end], 1)
        parts = _Portion(np.repeat(portion.line, 3), ends[:, :3].ravel(), ends[:, 1:].ravel())
        is_place = (ends[:, 3] == ends[:, 0])[:, None] & [True, False, False]
        return parts.only((parts.end > parts.first) | is_place.ravel())

    def _corners(self, portion: _Portion) -> tuple[np.ndarray, ...]:
        """Column and row of each portion's cell, and its heights at (0, 0), east, south and both."""
        col, row = self._cells(portion)
        posts = (self.heights[row + j, col + i].astype(float) for j, i in ((0, 0), (0, 1), (1, 0), (1, 1)))
        return (col, row, *posts)

    def _clearance_m(self, portion: _Portion, share: np.ndarray) -> np.ndarray:
        """Height over the land of places in the cells under the middles of portions; infinite over voids."""
        col, row, corner, east, south, both = self._corners(portion)
        line = portion.line
        u, v = (start[line] + share * step[line] for start, step in zip(self.start, self.step, strict=True))
        u, v = u - col, v - row
        land = corner + u * (east - corner) + v * (south - corner) + u * v * (corner - east - south + both)
        found = self.a[line, 2] + share * self.fall[line] - land
        found += self.bend * (share**2 * self.length2_m[line] + self._bulge_m(u, v))
        return np.where(np.isnan(found), np.inf, found)

    def _parabolas(self, cells: _Portion) -> tuple[tuple[np.ndarray, ...], np.ndarray, tuple[np.ndarray, ...]]:
        """Over each cell: the parabola's coefficients, its smallest value, and the land and its rise."""
        col, row, corner, east, south, both = self._corners(cells)
        line, share = cells.line, cells.first
        width = cells.end - share
        twist = corner - east - south + both
        along = self.step[0][line], self.step[1][line]
        u, v = self.start[0][line] + share * along[0] - col, self.start[1][line] + share * along[1] - row
        du, dv = width * along[0], width * along[1]
        # land at the fraction t of the way through the cell, plus what the curvature lowers it
        land = corner + u * (east - corner) + v * (south - corner) + u * v * twist
        rise = du * (east - corner) + dv * (south - corner) + (u * dv + v * du) * twist
        (lower, lower_after) = (
            self.bend * (s**2 * self.length2_m[line] + self._bulge_m(x, y))
            for s, x, y in ((share, u, v), (cells.end, u + du, v + dv))
        )
        fall = self.fall[line]
        q0 = self.a[line, 2] + share * fall - land + lower
        q1 = width * fall - rise + lower_after - lower
        q2 = -du * dv * twist
        with np.errstate(divide="ignore", invalid="ignore"):
            top = np.clip(np.where(q2 > 0, -q1 / (2 * q2), 0.0), 0.0, 1.0)
            low = np.minimum(np.minimum(q0, q0 + q1 + q2), q0 + q1 * top + q2 * top**2)
        return (q0, q1, q2), np.where(np.isfinite(low), low, np.inf), (land, rise)

    def _bulge_m(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """What makes the drop bilinear between posts: see glsl/blocks/view.glsl."""
        return self.spacing_m[0] ** 2 * u * (1 - u) + self.spacing_m[1] ** 2 * v * (1 - v)
