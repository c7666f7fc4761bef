"""The brush in the window: its settings, the dabs that are due, and the strokes that can be undone.

A stroke is all dabs from one press of the button to its release. Each dab updates the tables on the GPU, so the
certified bound holds during the stroke.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterator
from itertools import takewhile
from typing import NamedTuple

import numpy as np

from ..renderer import Renderer
from ..renderer.brush import SHARES, TOOLS, Brush, Sculptor, places

STEP = 2**0.25  # factor of one step of radius or strength
DAB_S = 0.1  # seconds between two dabs of a brush that is held still
MOST_POSTS = 512  # largest radius on a store, in posts
NEAR_RADII = 2.0  # dabs nearer to each other than this many radii are done together


class Dab(NamedTuple):
    """A dab that is still to be done."""

    brush: Brush
    place: tuple[float, float]  # world metres
    begins: bool  # whether it begins a stroke


class BrushTool:
    """The brush over one map."""

    def __init__(self, renderer: Renderer) -> None:
        self.renderer = renderer
        heightmap = renderer.heightmap
        low, high = heightmap.range_m
        self.tool = TOOLS[0]
        self.radius_m = min(0.04 * min(heightmap.extent_m), 0.1 * self.most_radius_m)
        self.strength_m = max(0.02 * (high - low), 1e-3)  # metres of each dab, for tools that move the ground
        self.share = 0.3  # for all other tools: how far a dab moves the ground towards its goal, 0 to 1
        self.azimuth_deg = 180.0
        self.due: deque[Dab] = deque()  # dabs that are still to be done, the next one first
        self._sculptor = Sculptor(renderer)
        self._last: tuple[float, float] | None = None
        self._dabbed_s = float("-inf")
        self._begins = True

    @property
    def most_radius_m(self) -> float:
        """The largest radius; a dab on a store reads all posts under it."""
        heightmap = self.renderer.heightmap
        posts_m = MOST_POSTS * min(heightmap.spacing_m) if heightmap.is_store else math.inf
        return min(max(heightmap.extent_m), posts_m)

    @property
    def brush(self) -> Brush:
        strength = self.share if self.tool in SHARES else self.strength_m
        return Brush(self.tool, self.radius_m, strength, azimuth_deg=self.azimuth_deg)

    def next_tool(self) -> str:
        self.tool = TOOLS[(TOOLS.index(self.tool) + 1) % len(TOOLS)]
        return self.tool

    def widen(self, steps: float) -> None:
        """Multiply the radius by ⁴√2 for each step."""
        least = min(self.renderer.heightmap.spacing_m)
        self.radius_m = min(max(self.radius_m * STEP**steps, least), self.most_radius_m)

    def strengthen(self, steps: float) -> None:
        """Multiply the strength by ⁴√2 for each step."""
        if self.tool in SHARES:
            self.share = min(max(self.share * STEP**steps, 0.01), 1.0)
        else:
            low, high = self.renderer.heightmap.range_m
            self.strength_m = min(max(self.strength_m * STEP**steps, 1e-4), max(high - low, 1.0))

    def begin(self, place: np.ndarray, now_s: float) -> None:
        self._last = None
        self._dabbed_s = float("-inf")
        self._begins = True
        self.move(place, now_s)

    def move(self, place: np.ndarray, now_s: float) -> None:
        """Queue dabs from the last place to this one. Their distance does not depend on the speed of the mouse."""
        end = float(place[0]), float(place[1])
        start = self._last or end
        if start == end and now_s - self._dabbed_s < DAB_S:
            return
        for each in places(start, end, 0.3 * self.radius_m):
            self.due.append(Dab(self.brush, each, self._begins))
            self._begins = False
        self._last = end
        self._dabbed_s = now_s

    def dab_steps(self) -> Iterator[float]:
        """Do the dabs that are due. Dabs that lie close together are one step."""
        while count := self._next_count():
            group = [self.due.popleft() for _ in range(count)]
            if group[0].begins:
                self._sculptor.begin()
            self._sculptor.dabs(group[0].brush, [dab.place for dab in group])
            yield 0.0

    def end(self) -> None:
        """End the stroke; light may be computed anew now."""
        self._last = None
        self._sculptor.end()

    @property
    def strokes(self) -> tuple[int, int]:
        """Number of strokes that can be undone, and number that can be done again."""
        return self._sculptor.can_undo, self._sculptor.can_redo

    @property
    def land(self) -> object:
        """An object that identifies the present land. Undoing a stroke brings the same object back; None at first."""
        return self._sculptor.land

    def undo(self) -> bool:
        """Undo the last stroke, with its dabs that are still due; False if there is none."""
        self._begins = True
        while self.due:
            if self.due.pop().begins:  # none of its dabs was done
                return True
        return self._step_back(self._sculptor.undo)

    def redo(self) -> bool:
        """Do the last undone stroke again; False if there is none."""
        return not self.due and self._step_back(self._sculptor.redo)

    def _step_back(self, step: Callable[[], bool]) -> bool:
        done = step()
        self._sculptor.end()
        return done

    def _next_count(self) -> int:
        """Number of the next dabs that are done together: equal dabs close to the first, if any are due."""
        if not self.due:
            return 0
        first = self.due[0]

        def joins(dab: Dab) -> bool:
            near = math.dist(dab.place, first.place) < NEAR_RADII * first.brush.radius_m
            return dab is first or (near and dab.brush == first.brush and not dab.begins)

        alike = sum(1 for _ in takewhile(joins, self.due))
        return alike
