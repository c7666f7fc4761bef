"""The mouse over the land: what a button, a motion and the wheel mean. Pixels count from the upper left."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from .controller import hit_ground

if TYPE_CHECKING:
    from .flight import Flight

CLICK_PX = 4.0  # further apart, and it was a drag
DIVIDER_PX = 8.0  # how near to the line between two sides one may take hold of it


class Mouse:
    """Where it is, and what is being dragged.

    Attributes
    ----------
    cursor
        Where it is over the land; None over a panel.
    drag
        "orbit", "look", "brush", "divider"; "" for nothing.
    """

    def __init__(self, flight: Flight) -> None:
        self._flight = flight
        self.cursor: tuple[float, float] | None = None
        self.drag = ""
        self._held = ""  # the button that drags
        self._pressed_at = (0.0, 0.0)
        self._pointed: tuple[float, float] | None = None

    @property
    def place(self) -> np.ndarray | None:
        """World metres of the land where it points, or did before it came to a panel; None for the sky."""
        return self.place_under(*self._pointed) if self._pointed else None

    def press(self, name: str, x: float, y: float) -> None:
        """A button goes down over the land; while one is held, others do nothing."""
        flight = self._flight
        if not flight.is_seen or self.drag:
            return
        self._pressed_at, self._pointed, self._held = (x, y), (x, y), name
        if name == "left" and self._near_divider(x):
            self.drag = "divider"
        elif name == "left" and flight.sculpting.brushing:
            if (place := self.place_under(x, y)) is not None and flight.sculpting.begin(place):
                self.drag = "brush"
        elif name == "left" and flight.controller.mode != "walk":
            self.drag = "orbit"
            flight.controller.grab(*self._tangents(x, y))
        else:
            self.drag = {"left": "look", "right": "look"}.get(name, "")

    def let_go(self, name: str, x: float, y: float) -> None:
        """It comes up again: where it went down, that was a click."""
        flight = self._flight
        if name != self._held:
            return
        drag, self.drag = self.drag, ""
        if not flight.has_map:
            return
        flight.controller.release()
        if drag == "brush":
            flight.sculpting.end()
        clicked = math.dist((x, y), self._pressed_at) < CLICK_PX * flight.scale
        if name == "left" and drag in ("orbit", "look") and clicked and flight.is_seen:
            flight.insight.explain(x, y)

    def point(self, x: float, y: float, look: bool = False, over_panels: bool = False) -> None:
        """The cursor comes to a place; `look`: the head turns with it, whether or not a button is held."""
        flight, settings = self._flight, self._flight.settings
        before, self._pointed = self._pointed or (x, y), (x, y)
        self.cursor = None if over_panels else (x, y)
        if not flight.has_map:
            return
        drag = "look" if look else self.drag
        dx, dy = (x - before[0]) / flight.scale, (y - before[1]) / flight.scale
        if drag == "divider":
            settings.divider = min(max(x / max(1, flight.size[0]), 0.02), 0.98)
            flight.refresh()
        elif drag in ("look", "orbit"):
            getattr(flight.controller, drag)(dx, dy)
        elif settings.split and not over_panels:
            settings.active = self.side_at(x)
        if settings.lens or settings.sums or flight.sculpting.brushing:
            flight.refresh()

    def wheel(self, notches: float, zoom: bool = False) -> None:
        """Change the speed, or the field of view."""
        flight = self._flight
        if not flight.has_map:
            return
        if zoom:
            flight.controller.zoom(notches)
        else:
            flight.controller.wheel(notches)
        flight.refresh()

    def side_at(self, x: float) -> int:
        """The side of a split picture there."""
        settings = self._flight.settings
        return int(settings.split and x > settings.divider * self._flight.size[0])

    def place_under(self, x: float, y: float) -> np.ndarray | None:
        """World metres of the land at a pixel; None for the sky."""
        controller = self._flight.controller
        ray = np.array([*self._tangents(x, y), 1.0]) @ controller.axes
        return hit_ground(controller.heightmap, controller.eye, ray)

    def _near_divider(self, x: float) -> bool:
        flight, settings = self._flight, self._flight.settings
        return settings.split and abs(x - settings.divider * flight.size[0]) < DIVIDER_PX * flight.scale

    def _tangents(self, x: float, y: float) -> tuple[float, float]:
        """A pixel as tangents right and up of the picture's middle."""
        width, height = self._flight.size
        half = math.tan(math.radians(0.5 * self._flight.controller.fov_deg)) / (0.5 * max(1, height))
        return (x - 0.5 * width) * half, (0.5 * height - y) * half
