"""Lines of sight over the truth: whether one place sees another, and which place hides it. Plain numpy.

The sight line from a to b is straight. The land under it is drawn lower, because the Earth is round: by the drop of
`camera.curvature`, with a as the eye. In each cell that the line crosses, the height of the line over the land is a
parabola: the land is bilinear, and the drop is a plane within a cell. So its smallest value is at one of two ends, or
at the parabola's top. b is seen if no cell has a value below 0.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .basics.exceptions import UsageError
from .readers.geodesy import WGS84
from .readers.georeference import Georeference

CURVATURES = ("auto", "on", "off")
FROM_M = 50e3  # "auto" draws a map flat if its longer side is shorter than this
GRAZING_M = 1e-7  # a line that is no deeper in the land than this passes it: both ends may stand on the ground
AT_ONCE = 1 << 16  # crossings of lines with cells that are computed at once


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
    seen = np.ones(len(a), bool)
    hidden_by = np.full((len(a), 3), np.nan)
    clearance_m = np.full(len(a), np.inf)
    for some in _portions(np.abs((b - a)[:, :2] / spacing_m).sum(1)):
        seen[some], hidden_by[some], clearance_m[some] = _followed(heights, spacing_m, a[some], b[some], bend)
    return Sight(seen.reshape(shape)[()], hidden_by.reshape(*shape, 3), clearance_m.reshape(shape)[()])


def _places(name: str, given: ArrayLike) -> np.ndarray:
    places = np.asarray(given, np.float64)
    if places.shape[-1:] != (3,) or not np.isfinite(places).all():
        raise UsageError(f"{name}: expected places X,Y,Z in metres, an array (..., 3), got shape {places.shape}")
    return places


def _portions(cells: np.ndarray) -> Iterator[np.ndarray]:
    """Indices of lines, in portions of lines that cross about as many cells each."""
    order = np.argsort(cells)
    end = len(order)
    while end > 0:
        first = max(0, end - max(1, int(AT_ONCE / (cells[order[end - 1]] + 3))))
        yield order[first:end]
        end = first


def _followed(
    heights: np.ndarray, spacing_m: tuple[float, float], a: np.ndarray, b: np.ndarray, bend: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    last = np.array([heights.shape[1] - 1, heights.shape[0] - 1])
    start, end = (np.stack([p[:, 0] / spacing_m[0], last[1] - p[:, 1] / spacing_m[1]], -1) for p in (a, b))
    step = end - start
    shares = _crossings(start, step, last)
    share, width = shares[:, :-1], np.diff(shares, axis=1)
    middle = start[:, None] + (share + 0.5 * width)[..., None] * step[:, None]
    inside = ((middle >= 0) & (middle <= last)).all(-1) & (width > 0)
    cell = np.clip(np.floor(middle), 0, last - 1).astype(np.int64)
    col, row = cell[..., 0], cell[..., 1]
    corner, east, south, both = (heights[row + j, col + i].astype(float) for j, i in ((0, 0), (0, 1), (1, 0), (1, 1)))
    twist = corner - east - south + both
    u, v = np.moveaxis(start[:, None] + share[..., None] * step[:, None] - cell, -1, 0)
    du, dv = np.moveaxis(width[..., None] * step[:, None], -1, 0)
    # land at the fraction t of the way through the cell, plus what the curvature lowers it
    land = corner + u * (east - corner) + v * (south - corner) + u * v * twist
    rise = du * (east - corner) + dv * (south - corner) + (u * dv + v * du) * twist
    (lower, lower_after) = (
        bend * (s**2 * _length2_m(step, spacing_m)[:, None] + _bulge_m(x, y, spacing_m))
        for s, x, y in ((share, u, v), (share + width, u + du, v + dv))
    )
    at_end = end - np.clip(np.floor(end), 0, last - 1)
    fall = b[:, 2] - a[:, 2] - bend * (_length2_m(step, spacing_m) + _bulge_m(at_end[:, 0], at_end[:, 1], spacing_m))
    q0 = a[:, 2:] + share * fall[:, None] - land + lower
    q1 = width * fall[:, None] - rise + lower_after - lower
    q2 = -du * dv * twist
    with np.errstate(divide="ignore", invalid="ignore"):
        top = np.clip(np.where(q2 > 0, -q1 / (2 * q2), 0.0), 0.0, 1.0)
        low = np.minimum(np.minimum(q0, q0 + q1 + q2), q0 + q1 * top + q2 * top**2)
    low = np.where(inside & np.isfinite(low), low, np.inf)
    clearance_m = low.min(1)
    seen = clearance_m >= -GRAZING_M
    hidden_by = np.full((len(a), 3), np.nan)
    line = np.flatnonzero(~seen)
    first = np.argmax(low[line] < -GRAZING_M, 1)
    c0, c1, c2 = (q[line, first] for q in (q0, q1, q2))
    root = -c1 + np.sqrt(np.maximum(c1**2 - 4 * c0 * c2, 0.0))  # the first zero of the parabola is 2 c0 / root
    t = np.where(c0 > 0, np.clip(2 * c0 / np.where(root > 0, root, 1.0), 0.0, 1.0), 0.0)
    along = (share[line, first] + t * width[line, first])[:, None]
    hidden_by[line, :2] = a[line, :2] + along * (b - a)[line, :2]
    hidden_by[line, 2] = land[line, first] + t * rise[line, first] - t**2 * c2
    return seen, hidden_by, clearance_m


def _crossings(start: np.ndarray, step: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Shares of each line, sorted: 0, its crossings with rows and columns of posts, 1; the rest of a row is 1."""
    found = [np.zeros((len(start), 1)), np.ones((len(start), 1))]
    for axis in (0, 1):
        low, high = np.sort(np.stack([start[:, axis], start[:, axis] + step[:, axis]]), 0)
        first, end = np.maximum(np.ceil(low), 0), np.minimum(np.floor(high), last[axis])
        lines = first[:, None] + np.arange(max(0, int((end - first).max()) + 1))
        moves = step[:, axis, None] != 0
        share = (lines - start[:, axis, None]) / np.where(moves, step[:, axis, None], 1.0)
        found.append(np.where(moves & (lines <= end[:, None]), np.clip(share, 0.0, 1.0), 1.0))
    return np.sort(np.concatenate(found, 1), 1)


def _length2_m(step: np.ndarray, spacing_m: tuple[float, float]) -> np.ndarray:
    return np.square(step * spacing_m).sum(-1)


def _bulge_m(u: np.ndarray, v: np.ndarray, spacing_m: tuple[float, float]) -> np.ndarray:
    """What makes the drop bilinear between posts: see glsl/blocks/view.glsl."""
    return spacing_m[0] ** 2 * u * (1 - u) + spacing_m[1] ** 2 * v * (1 - v)
