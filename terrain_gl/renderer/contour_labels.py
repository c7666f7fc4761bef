"""Heights of contour lines: written on index lines, few and apart, where a picture shows enough of the line."""

from __future__ import annotations

import math

import numpy as np

from ..basics.words import UNITS
from ..camera import Camera
from ..camera.pieces import Piece
from ..shade.contours import INDEX_EVERY
from ..shade.picture import Picture
from .names import Label

# Pixels of a picture of 720 rows; in larger pictures they grow with the type.
_CELL = np.array([240, 120])  # a grid has at most one label a cell
_HALF = np.array([28, 9])  # columns and rows from the middle of a label to its sides
_APART = 320  # from one label to the next of the same height
_STEP = 2  # every second pixel is looked at
_RIDGE = 1.25  # largest over smallest depth under a label; if it is larger, a ridge stands in front of other land


def contour_labels(
    picture: Picture, camera: Camera, piece: Piece, interval_m: float, least_m: float, units: str
) -> list[Label]:
    """Heights of the index lines that a piece of a picture shows, after it was drawn in the view of `camera`.

    Contour lines are `interval_m` apart, from the height `least_m` on.
    """
    z = picture.depths_m()[:: _STEP * piece.fine, :: _STEP * piece.fine]
    first = np.array([piece.cols.start, piece.rows.start]) + 0.5
    z = np.where(np.isfinite(z), z, np.nan)
    levels = _heights_m(z, first, camera, piece.picture) / (INDEX_EVERY * interval_m)
    places = _places(levels, z, max(1.0, piece.picture[1] / 720))
    heights_m = np.rint(levels[places[:, 1], places[:, 0]]) * INDEX_EVERY * interval_m
    is_there = heights_m >= least_m
    names = [f"{height_m / UNITS[units]:.7g} {units}" for height_m in heights_m[is_there]]
    return _apart(names, first + _STEP * places[is_there], max(1.0, piece.picture[1] / 720))


def _heights_m(z: np.ndarray, first: np.ndarray, camera: Camera, size: tuple[int, int]) -> np.ndarray:
    """Heights of the land at these depths: every `_STEP`-th pixel from the place `first` on."""
    rows, cols = (_STEP * np.arange(count) for count in z.shape)
    (tan_x, tan_y), (middle_x, middle_y) = camera.half_extent(size), camera.centre
    right, up, forward = camera.axes
    across = (2 * (first[0] + cols) / size[0] - 1) * tan_x + middle_x
    above = (1 - 2 * (first[1] + rows) / size[1]) * tan_y + middle_y
    aside = across[:, None] * right + above[:, None, None] * up
    from_eye = camera.w_at(z)[..., None] * aside + z[..., None] * forward
    return camera.eye[2] + from_eye[..., 2] + camera.bend_per_m * np.square(from_eye[..., :2]).sum(-1)


def _places(levels: np.ndarray, z: np.ndarray, scale: float) -> np.ndarray:
    """(n, 2) columns and rows on index lines where a label covers only one line, and no ridge or sky."""
    half = np.maximum(1, np.rint(_HALF * scale / _STEP)).astype(int)
    row, col = np.nonzero(np.floor(levels[1:]) != np.floor(levels[:-1]))
    at = np.stack([col, row], -1)
    at = at[((at >= half) & (at < np.array(levels.shape[::-1]) - half)).all(-1)]
    sides = np.array([(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)]) * half
    under = at[:, None] + sides
    level, depth = (each[under[..., 1], under[..., 0]] for each in (levels, z))
    return at[(np.ptp(level, 1) < 1) & (depth.max(1) < _RIDGE * depth.min(1))]


def _apart(names: list[str], places: np.ndarray, scale: float) -> list[Label]:
    """At most one name in each cell of the grid, the one nearest to its middle; equal names keep apart (`_APART`)."""
    cell = places / (_CELL * scale)
    from_middle = np.abs(cell - np.floor(cell) - 0.5).max(-1)
    found: dict[tuple[int, ...], Label] = {}
    for i in np.argsort(from_middle, kind="stable"):
        key, (x, y) = tuple(np.floor(cell[i]).astype(int)), places[i]
        same = (other for other in found.values() if other.name == names[i])
        if key not in found and all(math.dist((x, y), (other.x, other.y)) >= _APART * scale for other in same):
            found[key] = Label(names[i], float(x), float(y), is_centred=True)
    return list(found.values())
