"""Sculpting in the window: a brush under the cursor, strokes to be undone, the land written to a file.

Tables follow each dab on the GPU, so the promise holds while one sculpts; light follows when the stroke is done.
"""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Generator, Iterator
from itertools import takewhile
from pathlib import Path
from typing import Any

import numpy as np

from ..brush import TOOLS, Brush, Sculptor, places
from ..heightmap import Heightmap
from ..renderer import Renderer
from ..writers import as_options, format_of, write_heightmap

STEP = 2**0.25  # of radius and strength
DAB_S = 0.1  # between two dabs of a brush that is held still
TOGETHER = 2.0  # radii that dabs may lie apart to be done at once
_SHARES = ("smooth", "flatten")  # tools whose strength is a share


class Editing:
    """A brush in hand.

    Attributes
    ----------
    tool, radius_m
        As `Brush` takes them.
    strength_m, share
        Of tools that move the ground, and of those that go a share of the way.
    due
        Dabs that are still to be done: with which brush, and where in world metres.
    """

    def __init__(self, renderer: Renderer) -> None:
        self.renderer = renderer
        heightmap = renderer.heightmap
        low, high = heightmap.range_m
        self.tool = TOOLS[0]
        self.radius_m = 0.04 * min(heightmap.extent_m)
        self.strength_m, self.share = max(0.02 * (high - low), 1e-3), 0.3
        self.azimuth_deg = 180.0
        self.edited = False
        self.due: list[tuple[Brush, tuple[float, float]]] = []
        self._sculptor = Sculptor(renderer)
        self._last: tuple[float, float] | None = None
        self._dabbed_s = float("-inf")

    @property
    def brush(self) -> Brush:
        """The brush as it is held."""
        strength = self.share if self.tool in _SHARES else self.strength_m
        return Brush(self.tool, self.radius_m, strength, azimuth_deg=self.azimuth_deg)

    def making_room(self) -> Generator[float, None, None]:
        """Have tables that hold many more dabs, in portions."""
        low, high = self.renderer.heightmap.range_m
        more_m = max([0.5 * (high - low), *(4 * brush.strength for brush, _ in self.due)])
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
        if self.tool in _SHARES:
            self.share = min(max(self.share * STEP**steps, 0.01), 1.0)
        else:
            low, high = self.renderer.heightmap.range_m
            self.strength_m = min(max(self.strength_m * STEP**steps, 1e-4), max(high - low, 1.0))

    def begin(self, place: np.ndarray, now_s: float) -> None:
        """The button goes down on the land: a stroke begins."""
        deque(self.dabbing(), maxlen=0)  # what is left of the one before
        self._sculptor.begin()
        self._last, self._dabbed_s = None, float("-inf")
        self.move(place, now_s)

    def move(self, place: np.ndarray, now_s: float) -> None:
        """The brush is drawn on, or held: dabs are due, closely however fast it was."""
        end = float(place[0]), float(place[1])
        start = self._last or end
        if start == end and now_s - self._dabbed_s < DAB_S:
            return
        self.due += [(self.brush, each) for each in places(start, end, 0.3 * self.radius_m)]
        self._last, self._dabbed_s = end, now_s

    def dabbing(self) -> Iterator[float]:
        """Do the dabs that are due, as far as there is room: in portions, those that lie together as one."""
        while count := self._next():
            brush, (group, self.due) = self.due[0][0], (self.due[:count], self.due[count:])
            self.edited |= self._sculptor.dabs(brush, [place for _, place in group]) is not None
            yield 0.0

    def _next(self) -> int:
        """How many of the dabs that are due are done at once: none where there is no room for any."""
        if not self.due:
            return 0
        brush, first = self.due[0]
        alike = takewhile(
            lambda dab: dab[0] == brush and math.dist(dab[1], first) < TOGETHER * brush.radius_m, self.due
        )
        return min(len(list(alike)), self._most_dabs(brush))

    def _most_dabs(self, brush: Brush) -> int:
        """How many dabs stay within heights that the tables hold; more, and they would all be built anew, at once."""
        if brush.tool in _SHARES or not brush.strength:
            return len(self.due)
        return int(self.renderer.room_m / brush.strength)

    @property
    def has_room(self) -> bool:
        """Whether the tables hold the next dab."""
        return not self.due or self._next() > 0

    def end(self) -> None:
        """The button comes up: the light may follow."""
        self._last = None
        self._sculptor.end()

    def undo(self) -> bool:
        """Take the last stroke back; False if there is none."""
        deque(self.dabbing(), maxlen=0)
        return self._again(self._sculptor.undo)

    def redo(self) -> bool:
        """Do the last one that was undone again; False if there is none."""
        deque(self.dabbing(), maxlen=0)
        return self._again(self._sculptor.redo)

    def _again(self, step: Any) -> bool:
        done = bool(step())
        self.edited |= done
        self._sculptor.end()
        return done


class Saving:
    """A map on its way to a file, in a thread.

    Attributes
    ----------
    message
        How it went, in a line, once it is done.
    """

    def __init__(self, path: str, heightmap: Heightmap, factor: float = 1.0) -> None:
        format_of(path)
        self.path, self.progress, self.message = path, 0.0, ""
        plain = Heightmap(heightmap.heights / np.float32(factor), heightmap.spacing_m, heightmap.name)
        self._thread = threading.Thread(target=self._write, args=(plain,), name=f"writing {path}")
        self._thread.start()

    def join(self) -> None:
        """Wait until it is done."""
        self._thread.join()

    def _write(self, heightmap: Heightmap) -> None:
        try:
            opening = write_heightmap(self.path, heightmap, self._tell)
            self.message = f"saved {self.path}; to open it again: {as_options(opening)}"
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
