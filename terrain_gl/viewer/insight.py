"""Seeing how detail comes about: levels that are frozen, two sides, a patch that is explained, a table's box."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..camera import Camera
from ..drawing import METHODS
from ..explain import Explanation
from .lesson import BoxSum
from .marks import Frame, box_under, sums_frame

if TYPE_CHECKING:
    from .flight import Flight


class Insight:
    """What is looked into.

    Attributes
    ----------
    frozen
        The eye that the levels are chosen for; None if it is the one that sees them.
    explanation
        Of the patch that was clicked.
    box
        The summed-area table's box under the cursor.
    """

    def __init__(self, flight: Flight) -> None:
        self._flight = flight
        self.frozen: Camera | None = None
        self.explanation: Explanation | None = None
        self.box: BoxSum | None = None

    def put_away(self) -> None:
        """Forget what was told of the land."""
        self.explanation = self.box = None

    def put_tool_away(self) -> bool:
        """Put one thing away that changes how the land is seen; whether there was any."""
        settings = self._flight.settings
        if settings.lens:
            self.toggle_lens()
        elif settings.sums:
            settings.sums = False
        elif settings.split:
            self.toggle_split()
        elif self.frozen:
            self.toggle_freeze()
        else:
            return False
        return True

    def toggle_wires(self) -> None:
        """Draw the mesh over the picture, or not."""
        settings = self._flight.settings
        settings.draw(wires=not settings.drawing.wires)

    def toggle_freeze(self) -> None:
        """Keep the levels that were chosen for the eye where it is now, or choose again."""
        self.frozen = None if self.frozen else self._flight.controller.camera
        self._flight.say(
            "levels stay, also out of sight: fly around them; L lets go"
            if self.frozen
            else "levels follow the eye again"
        )

    def toggle_split(self) -> None:
        """Two sides to compare, or one."""
        settings = self._flight.settings
        if settings.split:
            settings.sides, settings.active = [settings.sides[0]], 0
            self._flight.say("one picture again")
        else:
            other = [method for method in METHODS if method != settings.drawing.method][0]
            settings.sides = [settings.drawing, settings.drawing.otherwise(method=other, triangles=None)]
            self._flight.say("two sides: keys and controls change the one under the cursor; drag the line between them")

    def toggle_lens(self) -> None:
        """A magnifying glass under the cursor, or none."""
        settings = self._flight.settings
        settings.lens = 0.0 if settings.lens else 6.0

    def explain(self, x: float, y: float) -> None:
        """Explain the patch at a pixel, or put the explanation away where there is none."""
        flight = self._flight
        self.explanation = None
        flight.refresh()
        place = flight.mouse.place_under(x, y)
        if place is None or flight.painter.drawn is None or flight.keeping.shot:
            return
        wanted, side = flight.wanted(), flight.mouse.side_at(x)
        flight.painter.ready_for(flight.renderer, wanted, side)
        self.explanation = flight.renderer.explain(float(place[0]), float(place[1]))
        if side:
            flight.painter.ready_for(flight.renderer, wanted, 0)
        if self.explanation is None:
            method = wanted.sides[side].method
            flight.say(f"no patch of the quadtree there: method {method} makes no promise to explain")

    def follow_cursor(self) -> None:
        """Read the table's box where the cursor is now."""
        flight = self._flight
        if not flight.settings.sums:
            self.box = None
        elif flight.mouse.cursor and (place := flight.mouse.place_under(*flight.mouse.cursor)) is not None:
            self.box = box_under(flight, place)

    @property
    def sums_frame(self) -> Frame:
        """Where the summed-area table is shown: left, bottom, width, height from the lower left."""
        return sums_frame(self._flight.renderer.heightmap, self._flight.size, self._flight.scale)
