"""The place at which the mouse points, in the picture and on the land. Pixels count from the upper left."""

import math

import numpy as np

from .pose import on_map, raised, vector
from .scene import Scene

DIVIDER_PX = 8.0  # a press this close to the divider of a split picture drags it


class Pointer:
    """The cursor."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self.over_land: tuple[float, float] | None = None  # the cursor in pixels; None over a panel
        self.last: tuple[float, float] | None = None  # the same, also over a panel; None before any event

    @property
    def place(self) -> np.ndarray | None:
        """The place of the land under the cursor, in world metres; None for the sky."""
        return self.place_under(*self.last) if self.last else None

    def place_under(self, x: float, y: float) -> np.ndarray | None:
        """The place of the land at a pixel, in world metres; None for the sky."""
        controller = self._scene.controller
        seen = controller.ground_at(*self.tangents(x, y))
        if seen is None:
            return None
        drawn = on_map(seen, controller.eye, controller.bend_per_m)
        return np.array(raised(vector(drawn), 1 / controller.exaggeration))

    def side_at(self, x: float) -> int:
        """The side of a split picture at a column of pixels."""
        return self._scene.split.side_at(x / max(1, self._scene.window.size[0]))

    def is_on_divider(self, x: float) -> bool:
        """Whether a column of pixels is at the divider of a split picture."""
        settings = self._scene.settings
        window = self._scene.window
        return settings.split and abs(x - settings.divider * window.size[0]) < DIVIDER_PX * window.scale

    def tangents(self, x: float, y: float) -> tuple[float, float]:
        """The direction to a pixel, as tangents right and up from the middle of the picture."""
        width, height = self._scene.window.size
        x -= self._scene.split.parts(width)[self.side_at(x)].shift
        half = math.tan(math.radians(0.5 * self._scene.controller.fov_deg)) / (0.5 * max(1, height))
        return (x - 0.5 * width) * half, (0.5 * height - y) * half
