"""Lines over the land: a frozen camera's frustum, an explained patch, the brush's ring, a box of the table."""

import math

import numpy as np

from ..heightmap import Heightmap
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
_WORST = 0.025  # radius of the ring around the largest error, relative to its distance from the eye
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
        if scene.frozen and patch.hidden_by and explainer.place is not None:
            eye = np.array(scene.for_renderer(scene.frozen).eye)
            lines.append((_sight_line(heightmap, eye, patch.hidden_by, explainer.place), _PICKED))
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


def largest_error(scene: Scene, explainer: Explainer, side: int) -> list[Line]:
    """A circle around the largest error of a side, if its colours show errors."""
    if (worst := explainer.worst(side)) is None:
        return []
    return [(_circle(worst, scene, _WORST) / (1.0, 1.0, scene.exaggeration), _BRUSH)]


def _circle(place: np.ndarray, scene: Scene, size: float) -> np.ndarray:
    """A circle that faces the eye, in front of a place of the land; `size` is relative to the distance from the eye."""
    controller, turn = scene.controller, np.linspace(0, 2 * math.pi, 64)
    away = place * [1.0, 1.0, scene.exaggeration] - controller.eye
    right, up, _ = controller.axes
    around = np.cos(turn)[:, None] * right + np.sin(turn)[:, None] * up
    return controller.eye + 0.5 * away + 0.5 * size * float(np.linalg.norm(away)) * around


def _sight_line(heightmap: Heightmap, eye: np.ndarray, ridge: tuple[float, float], place: np.ndarray) -> np.ndarray:
    """From an eye over a ridge to above the place that the ridge hides, and down to the place."""
    top = on_land(heightmap, np.array([ridge]))[0]
    reach = np.linalg.norm(place[:2] - eye[:2]) / max(float(np.linalg.norm(top[:2] - eye[:2])), 1e-9)
    return np.stack([eye, top, [*place[:2], eye[2] + reach * (top[2] - eye[2])], place])


def sums_frame(table: Size, size: Size, scale: float) -> Frame:
    """The frame in which a summed-area table of some columns and rows is shown."""
    side = 0.38 * min(size)
    width, height = (max(1, round(side * n / max(table))) for n in table)
    margin = round(10 * scale)
    return size[0] - width - margin, size[1] - height - margin, width, height
