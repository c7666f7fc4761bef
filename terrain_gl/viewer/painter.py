"""The picture that is wanted, drawn if it is not the one that is there: at once in motion, in portions at rest.

    in motion, or dark    at once, coarsely where full pictures take long           (pace.py)
    at rest               in full: at once where that is quick, else in portions
    then                  light follows, in portions; when it has come the picture is drawn anew
    and then              its error is measured, in portions

It is dark until there is any light for the look; after an edit there is, that of the land before.

What a picture depends on is one record, `Wanted`. Time comes in from outside, so that tests need no clock.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import dataclass
from typing import Any

import moderngl

from ..camera import Camera
from ..drawing import Drawing
from ..measure import Achieved
from ..renderer import Renderer
from ..shade import UNLIT, Look
from .canvas import Canvas
from .charts import History
from .dawn import Dawn
from .hud import Figures, achieved_px, drawing_ms
from .pace import Pace

REST_S = 0.25  # without a change until a full picture is drawn
PORTION = 256  # posts a side that are measured between two looks at the window's events
Size = tuple[int, int]


@dataclass(frozen=True)
class Wanted:
    """Everything that a picture depends on, the map aside."""

    camera: Camera
    size: Size
    sides: tuple[Drawing, ...]
    divider: float

    def part(self, side: int) -> tuple[float, float]:
        """Where a side begins and ends, 0 to 1."""
        if len(self.sides) == 1:
            return 0.0, 1.0
        return (0.0, self.divider) if side == 0 else (self.divider, 1.0)

    @property
    def lit_look(self) -> Look:
        """What light is made for: nothing but what it depends on."""
        lit = next((side.look for side in self.sides if side.look.is_lit), None)
        return Look(sun=lit.sun, sky=lit.sky, material=lit.material) if lit else Look(UNLIT)


class Painter:
    """Draws on a canvas.

    Attributes
    ----------
    figures, history, side_stats
        What is known of the last picture, of those before it, and of each of its sides.
    dawn
        Light on its way.
    drawn
        What the canvas shows; None if nothing that is still true.
    has_picture
        Whether it shows anything at all.
    """

    def __init__(self, ctx: moderngl.Context, pace: Pace) -> None:
        self.pace, self.canvas, self.dawn = pace, Canvas(ctx), Dawn(pace)
        self.history, self.figures = History(), Figures("", (0, 0))
        self.side_stats: list[dict[str, Any]] = []
        self.drawn: Wanted | None = None
        self.has_picture = False
        self._asked: Wanted | None = None
        self._asked_s = self._drawn_s = float("-inf")
        self._painting: tuple[Wanted, Generator[float, None, None]] | None = None
        self._measuring: Iterator[Achieved] | None = None
        self._achieved: Achieved | None = None
        self._unmeasured = False

    # --- What happens to it -------------------------------------------------------------------------------------------

    def new_map(self, figures: Figures | None) -> None:
        """There is another map, or the same with more posts: nothing is known of it."""
        self.figures = figures or self.figures
        self.forget()
        self.dawn.stop()
        self.pace.full_ms = float("inf")

    def forget(self, at_once: bool = False) -> None:
        """The land or its light is another: what was drawn is true no more; `at_once`: show it, in full later."""
        self.drawn = None
        if at_once:
            self._asked = None
        self.interrupt()

    def interrupt(self) -> None:
        """Something else is about to be drawn with the renderer."""
        self._painting = self._measuring = None

    def release(self) -> None:
        """Give the GPU's memory back."""
        self.dawn.release()
        self.canvas.release()

    # --- What it is at ------------------------------------------------------------------------------------------------

    def ready_for(self, renderer: Renderer, wanted: Wanted, side: int) -> None:
        """Have the renderer speak of a side as it is in full, whatever it is at."""
        self.interrupt()
        _resize(renderer, wanted.size)
        renderer.choose(wanted.camera, **vars(wanted.sides[side]))

    def is_busy(self, wanted: Wanted) -> bool:
        """Whether there is something to be done at once."""
        under_way = self._painting is not None or self._measuring is not None
        return under_way or wanted != self.drawn or self.dawn.is_due(wanted.lit_look)

    def is_done(self, wanted: Wanted) -> bool:
        """Whether the picture is the one that is wanted, drawn in full and lit; it may not be measured yet."""
        return wanted == self.drawn and self.figures.shrunk == 1 and not self.dawn.is_due(wanted.lit_look)

    @property
    def waits_for_rest(self) -> bool:
        """Whether there is more to be done when nothing has changed for a while."""
        return self.figures.shrunk > 1 or self.figures.fps is not None or self._unmeasured

    def step(self, renderer: Renderer, wanted: Wanted, now_s: float, moving: bool, lights: bool = True) -> bool:
        """Do what is due, for a while; whether there is anything new to see.

        Parameters
        ----------
        moving
            It will be another picture soon.
        lights
            Whether light is worth making.
        """
        if wanted != self._asked:
            self._asked, self._asked_s = wanted, now_s
        unlit, fresh = self.dawn.is_due(wanted.lit_look), self.drawn is None
        dark = unlit and not (self.dawn.lit == wanted.lit_look and renderer.picture.lighting.is_there)
        hurried = moving or dark or now_s - self._asked_s < REST_S
        if hurried and wanted != self.drawn:
            self._draw(renderer, wanted, now_s)
            changed = True
        elif not hurried:
            changed = self._rest(renderer, wanted, now_s, measures=not unlit)
        else:
            changed = False
        if unlit and lights and not fresh and not self._painting:  # what is new is shown first
            if self.dawn.go_on(renderer.picture, wanted.lit_look, moving):
                self.forget()
            changed = True
        return changed

    # --- Drawing ------------------------------------------------------------------------------------------------------

    def _draw(self, renderer: Renderer, wanted: Wanted, now_s: float) -> None:
        """At once, as coarsely as it takes."""
        self.interrupt()
        shrink = self.pace.shrink
        size = max(1, wanted.size[0] // shrink), max(1, wanted.size[1] // shrink)
        _resize(renderer, size)
        stats = []
        for side in _last_first(wanted):
            stats.append(renderer.draw(wanted.camera, **vars(wanted.sides[side])))
            self.canvas.compose(renderer, wanted.size, *wanted.part(side))
        self._note(wanted, stats[::-1], shrink)
        self.figures.fps = self._rate(now_s - self._drawn_s)
        self._drawn_s = now_s

    def _rest(self, renderer: Renderer, wanted: Wanted, now_s: float, measures: bool) -> bool:
        """In full, then measured; whether there is anything new to see."""
        was_moving, self.figures.fps = self.figures.fps is not None, None
        if self._painting and self._painting[0] != wanted:
            self.interrupt()
        if not self._painting and (wanted != self.drawn or self.figures.shrunk > 1):
            self.interrupt()
            self._painting = wanted, self._paint(renderer, wanted)
        if self._painting:
            if not self.pace.go_on(self._painting[1]):
                return was_moving
            self._painting, self._drawn_s = None, now_s
            return True
        return (measures and self._measure(renderer)) or was_moving

    def _paint(self, renderer: Renderer, wanted: Wanted) -> Generator[float, None, None]:
        """The full picture, in portions; the canvas changes side by side."""
        _resize(renderer, wanted.size)
        stats = []
        for side in _last_first(wanted):
            stats.append((yield from renderer.drawing(wanted.camera, **vars(wanted.sides[side]))))
            self.canvas.compose(renderer, wanted.size, *wanted.part(side))
        self._note(wanted, stats[::-1], 1)

    def _note(self, wanted: Wanted, stats: list[dict[str, Any]], shrunk: int) -> None:
        """What is known of a picture that has just been drawn."""
        self.drawn, self.side_stats, self.has_picture = wanted, stats, True
        self.figures.stats, self.figures.shrunk, self.figures.measured_px = stats[0], shrunk, None
        self._unmeasured = True
        self.history.add(stats[0])
        if shrunk == 1:
            self.pace.full_ms = sum(map(drawing_ms, stats))

    def _rate(self, seconds: float) -> float | None:
        """Frames a second, smoothed."""
        fps = self.figures.fps
        if not 0 < seconds < 2:
            return fps
        return 1 / seconds if not fps else 0.9 * fps + 0.1 / seconds

    def _measure(self, renderer: Renderer) -> bool:
        """Measure a portion of the last picture; whether the outcome has come."""
        if not self._unmeasured:
            return False
        if not self._measuring:
            self._measuring, self._achieved = renderer.measuring(PORTION), None
        if portion := next(self._measuring, None):
            self._achieved = portion
            return False
        self._measuring, self._unmeasured = None, False
        if self._achieved:  # there was something in the picture
            self.figures.measured_px = {"max": self._achieved.max_px, "rms": self._achieved.rms_px}
            if (px := achieved_px(self.figures.measured_px, self.figures.stats)) is not None:
                self.history.measured(px)
        return True


def _last_first(wanted: Wanted) -> range:
    """Sides in the order in which they are drawn: the renderer then speaks of the first."""
    return range(len(wanted.sides) - 1, -1, -1)


def _resize(renderer: Renderer, size: Size) -> None:
    if size != renderer.size:
        renderer.resize(size)
