"""Names of points: where they are in a picture. The name of a point that land hides is left out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..camera import Camera
from ..camera.camera import in_picture
from ..camera.pieces import Piece
from ..shade.picture import Picture
from .lines import posts_on_land
from .overlay import Overlay

_SLACK = 0.985  # a point up to 1.5 % behind the drawn land, which has errors, counts as visible: glsl/view/lines.frag


class Label(NamedTuple):
    """A name, and the column and row of its point, counted from the upper left corner of the whole picture.

    The name is at the lower right of its point, or centred on it.
    """

    name: str
    x: float
    y: float
    is_centred: bool = False


def labels_seen(
    overlays: Sequence[Overlay], picture: Picture, camera: Camera, near_m: float, piece: Piece
) -> list[Label]:
    """The names of points that a piece of a picture shows, after it was drawn in the view `camera`, `near_m`."""
    named = [pair for overlay in overlays for pair in zip(overlay.names, overlay.points, strict=False) if pair[0]]
    if not named:
        return []
    heightmap = picture.terrain.heightmap
    places = posts_on_land(heightmap, np.array([point for _, point in named]))
    from_eye = camera.lowered(places) - np.asarray(camera.eye)
    x, y, z = np.nan_to_num(from_eye @ camera.axes.T, nan=-1.0).T
    is_there = in_picture(camera, piece.picture, (x, y, z), near_m)
    if not is_there.any():
        return []
    depths_m = _furthest(picture.depths_m())
    pixels = camera.pixels(camera.lowered(places), piece.picture) + 0.5
    found = []
    for i in np.flatnonzero(is_there):
        column, row = pixels[i]
        at = int((row - piece.rows.start) * piece.fine), int((column - piece.cols.start) * piece.fine)
        inside = 0 <= at[0] < depths_m.shape[0] and 0 <= at[1] < depths_m.shape[1]
        if inside and _SLACK * z[i] <= depths_m[at]:
            found.append(Label(named[i][0], float(column), float(row)))
    return found


def _furthest(depths_m: np.ndarray) -> np.ndarray:
    """The furthest depth of each pixel and its eight neighbours: a point may lie on the crest that hides the rest."""
    wide = np.pad(depths_m, 1, mode="edge")
    rows, cols = depths_m.shape
    return np.max([wide[i : i + rows, j : j + cols] for i in range(3) for j in range(3)], 0)
