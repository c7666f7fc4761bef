"""Lines over the land: a frozen camera's frustum, an explained patch, the brush's ring, a box of the table."""

import math

import numpy as np

from ..renderer.lines import Line, frustum, on_land, outline, ring
from .explainer import Explainer
from .pointer import Pointer
from .ruler import Ruler
from .scene import Scene
from .sculpting import Sculpting
from .window_state import Frame, Size

_FRUSTUM = (255, 205, 120, 255)
_PICKED = (255, 120, 90, 255)
_BRUSH = (255, 255, 255, 230)
_RULER = (255, 235, 90, 255)
_CORNER = 0.008  # radius of the ring around a corner of the ruler, as a fraction of its distance from the eye


def lines_on_land(
    scene: Scene, pointer: Pointer, explainer: Explainer, sculpting: Sculpting, ruler: Ruler
) -> list[Line]:
    """All lines of this frame, at the heights of the map, also where the relief is drawn higher."""
    lines: list[Line] = []
    heightmap = scene.heightmap
    higher = 1.0, 1.0, scene.exaggeration
    if scene.frozen:
        edges = frustum(scene.frozen, scene.window.size, 0.25 * math.hypot(*heightmap.extent_m))
        lines += [(edge / higher, _FRUSTUM) for edge in edges]
    if patch := explainer.explanation:
        lines.append((outline(heightmap, patch.corner, (patch.side, patch.side)), _PICKED))
    place = pointer.place if sculpting.brushing and pointer.over_land else None
    if sculpting.tool and place is not None:
        lines.append((ring(heightmap, float(place[0]), float(place[1]), sculpting.tool.radius_m), _BRUSH))
    if measured := ruler.profile(heightmap):
        lines.append((on_land(heightmap, measured.places), _RULER))
    for corner in on_land(heightmap, np.reshape(ruler.corners, (-1, 2))):
        radius_m = _CORNER * float(np.linalg.norm(corner * higher - scene.controller.eye))
        lines.append((ring(heightmap, float(corner[0]), float(corner[1]), radius_m, 24), _RULER))
    if explainer.box:
        lines.append((outline(heightmap, *explainer.box.on_map), _PICKED))
    return lines


def sums_frame(table: Size, size: Size, scale: float) -> Frame:
    """The frame in which a summed-area table of some columns and rows is shown."""
    side = 0.38 * min(size)
    width, height = (max(1, round(side * n / max(table))) for n in table)
    margin = round(10 * scale)
    return size[0] - width - margin, size[1] - height - margin, width, height
