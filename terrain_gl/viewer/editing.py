"""Sculpting in the window: a brush under the cursor, strokes to be undone, the land written to a file.

Tables follow each dab on the GPU, so the promise holds while one sculpts; light follows when the stroke is done.
"""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterator
from itertools import takewhile
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..brush import SHARES, TOOLS, Brush, Sculptor, places
from ..heightmap import Heightmap
from ..renderer import Renderer
from ..writers import as_options, format_of, write_heightmap

STEP = 2**0.25  # of radius and strength
DAB_S = 0.1  # between two dabs of a brush that is held still
TOGETHER = 2.0  # radii that dabs may lie apart to be done at once


class Dab(NamedTuple):
    """A dab that is still to be done."""

    brush: Brush
    place: tuple[float, float]  # world metres
    begins: bool  # a stroke


class Editing:
    """A brush in hand.

    Attributes
    ----------
    tool, radius_m, azimuth_deg
        As `Brush` takes them.
    strength_m, share
        Of tools that move the ground, in metres, and of those that go a share of the way, 0 to 1.
    due
        Dabs that are still to be done, the next one first.
    edits
        How often the land was changed.
    waits_for_room
        Whether dabs that would leave the span of the tables wait; if not, all tables are built anew with them.
    """

    def __init__(self, renderer: Renderer) -> None:
        self.renderer = renderer
        heightmap = renderer.heightmap
        low, high = heightmap.range_m
        self.tool = TOOLS[0]
        self.radius_m = 0.04 * min(heightmap.extent_m)
        self.strength_m, self.share = max(0.02 * (high - low), 1e-3), 0.3
        self.azimuth_deg = 180.0
        self.edits = 0
        self.due: deque[Dab] = deque()
        self.waits_for_room = True
        self._sculptor = Sculptor(renderer)
        self._last: tuple[float, float] | None = None
        self._dabbed_s = float("-inf")
        self._begins = True

    def take_over(self, before: Editing, factor: float) -> None:
        """Be held as another brush was, on land that is `factor` times as high."""
        self.tool, self.radius_m, self.share, self.edits = before.tool, before.radius_m, before.share, before.edits
        self.strength_m, self.azimuth_deg = factor * before.strength_m, before.azimuth_deg

    @property
    def brush(self) -> Brush:
        """The brush as it is held."""
        strength = self.share if self.tool in SHARES else self.strength_m
        return Brush(self.tool, self.radius_m, strength, azimuth_deg=self.azimuth_deg)

    def making_room(self) -> Generator[float, None, None]:
        """Have tables that hold half the relief more, and four dabs at least, above and below; in portions."""
        low, high = self.renderer.heightmap.range_m
        strongest = max(brush.strength for brush in (self.brush, *(dab.brush for dab in self.due)))
        more_m = max(0.5 * (high - low), 4 * strongest)
        return self.renderer.making_room(more_m, more_m)

    @property
    def strokes(self) -> tuple[int, int]:
        """How many can be undone, and done again."""
        return self._sculptor.can_undo, self._sculptor.can_redo

    def widen(self, steps: float) -> None:
        """Change the radius by steps of ×⁴√2."""
        least, most = min(self.renderer.heightmap.spacing_m), max(self.renderer.heightmap.extent_m)
        self.radius_m = min(max(self.radius_m * STEP**steps, least), most)

    def strengthen(self, steps: float) -> None:
        """Change the strength, as the tool has it."""
        if self.tool in SHARES:
            self.share = min(max(self.share * STEP**steps, 0.01), 1.0)
        else:
            low, high = self.renderer.heightmap.range_m
            self.strength_m = min(max(self.strength_m * STEP**steps, 1e-4), max(high - low, 1.0))

    def begin(self, place: np.ndarray, now_s: float) -> None:
        """The button goes down on the land: a stroke begins."""
        self._last, self._dabbed_s, self._begins = None, float("-inf"), True
        self.move(place, now_s)

    def move(self, place: np.ndarray, now_s: float) -> None:
        """The brush is drawn on, or held: dabs are due, closely however fast it was."""
        end = float(place[0]), float(place[1])
        start = self._last or end
        if start == end and now_s - self._dabbed_s < DAB_S:
            return
        for each in places(start, end, 0.3 * self.radius_m):
            self.due.append(Dab(self.brush, each, self._begins))
            self._begins = False
        self._last, self._dabbed_s = end, now_s

    def dabbing(self) -> Iterator[float]:
        """Do the dabs that are due, as far as there is room: in portions, those that lie together as one."""
        while count := self._next():
            group = [self.due.popleft() for _ in range(count)]
            if group[0].begins:
                self._sculptor.begin()
            self.edits += self._sculptor.dabs(group[0].brush, [dab.place for dab in group]) is not None
            yield 0.0

    @property
    def has_room(self) -> bool:
        """Whether the tables hold the next dab."""
        return not self.due or self._next() > 0

    def _next(self) -> int:
        """How many of the dabs that are due are done at once: none where there is no room for any."""
        if not self.due:
            return 0
        first = self.due[0]

        def together(dab: Dab) -> bool:
            near = math.dist(dab.place, first.place) < TOGETHER * first.brush.radius_m
            return dab is first or (near and dab.brush == first.brush and not dab.begins)

        alike = sum(1 for _ in takewhile(together, self.due))
        return int(min(alike, self._most_dabs(first.brush))) if self.waits_for_room else alike

    def _most_dabs(self, brush: Brush) -> float:
        """How many dabs stay within heights that the tables hold."""
        down_m, up_m = self.renderer.room_m
        if brush.tool in SHARES or not brush.strength:
            return math.inf
        return (down_m if brush.tool == "lower" else up_m) / brush.strength

    def end(self) -> None:
        """The stroke is done: the light may follow."""
        self._last = None
        self._sculptor.end()

    def undo(self) -> bool:
        """Take the last stroke back, and what of it is still to be done; False if there is none."""
        self._begins = True
        return self._forget_last() or self._again(self._sculptor.undo)

    def redo(self) -> bool:
        """Do the last one that was undone again; False if there is none."""
        return not self.due and self._again(self._sculptor.redo)

    def _forget_last(self) -> bool:
        """Forget what is due of the last stroke; whether nothing of it was done."""
        while self.due:
            if self.due.pop().begins:
                return True
        return False

    def _again(self, step: Callable[[], bool]) -> bool:
        done = step()
        self.edits += done
        self._sculptor.end()
        return done


class Saving:
    """A map on its way to a file, in a thread.

    Attributes
    ----------
    message
        How it went, in a line, once it is done.
    done
        Whether the file is there.
    edits
        How often the land had been changed.
    """

    def __init__(self, path: str, heightmap: Heightmap, factor: float = 1.0, edits: int = 0) -> None:
        format_of(path)
        self.path, self.progress, self.message, self.done, self.edits = path, 0.0, "", False, edits
        plain = Heightmap(heightmap.heights / np.float32(factor), heightmap.spacing_m, heightmap.name)
        self._thread = threading.Thread(target=self._write, args=(plain,), name=f"writing {path}")
        self._thread.start()

    def join(self) -> None:
        """Wait until it is done."""
        self._thread.join()

    def _write(self, heightmap: Heightmap) -> None:
        try:
            opening = write_heightmap(self.path, heightmap, self._tell)
            self.done = True
            self.message = f"saved {Path(self.path).absolute()}; to open it again: {as_options(opening)}"
        except MemoryError:
            self.message = "not enough memory"
        except Exception as error:  # whatever it is, the window goes on and tells
            self.message = str(error) or type(error).__name__

    def _tell(self, part: float) -> None:
        self.progress = part


def suggested_path(map_name: str) -> str:
    """A file name that is not taken yet."""
    stem = Path(map_name).stem or "terrain"
    number = 1
    while Path(name := f"{stem}-edited-{number}.tif").exists():
        number += 1
    return name
