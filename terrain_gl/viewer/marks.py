"""What is drawn over the land: a frozen eye's frustum, the patch that is explained, the brush's ring, a table's box."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from ..heightmap import Heightmap
from .lesson import BoxSum, box_around
from .lines import Line, frustum, outline, ring

if TYPE_CHECKING:
    from .flight import Flight

_FRUSTUM, _PICKED, _BRUSH = (255, 205, 120, 255), (255, 120, 90, 255), (255, 255, 255, 230)
Frame = tuple[int, int, int, int]


def lines_on_land(flight: Flight) -> list[Line]:
    """All lines of this frame."""
    lines: list[Line] = []
    heightmap = flight.renderer.heightmap
    if flight.insight.frozen:
        pyramid = frustum(flight.insight.frozen, flight.size, 0.25 * math.hypot(*heightmap.extent_m))
        lines += [(edge, _FRUSTUM) for edge in pyramid]
    if told := flight.insight.explanation:
        lines.append((outline(heightmap, told.corner, (told.side, told.side)), _PICKED))
    editing = flight.sculpting.editing
    place = flight.mouse.place if flight.sculpting.brushing and flight.mouse.cursor else None
    if editing and place is not None:
        lines.append((ring(heightmap, float(place[0]), float(place[1]), editing.radius_m), _BRUSH))
    if flight.insight.box:
        x0, y0, x1, y1 = flight.insight.box.box
        lines.append((outline(heightmap, (x0, y0), (x1 - x0 - 1, y1 - y0 - 1)), _PICKED))
    return lines


def sums_frame(heightmap: Heightmap, size: tuple[int, int], scale: float) -> Frame:
    """Where the summed-area table is shown, at the upper right: left, bottom, width, height from the lower left."""
    side = 0.38 * min(size)
    width, height = (max(1, round(side * n / max(heightmap.heights.shape))) for n in (heightmap.cols, heightmap.rows))
    margin = round(10 * scale)
    return size[0] - width - margin, size[1] - height - margin, width, height


def box_under(flight: Flight, place: np.ndarray) -> BoxSum:
    """The table's box around a place of the land."""
    heightmap = flight.renderer.heightmap
    east, north = heightmap.spacing_m
    col, row = round(place[0] / east), round(heightmap.rows - 1 - place[1] / north)
    return box_around(flight.renderer, int(col), int(row), flight.settings.box)
