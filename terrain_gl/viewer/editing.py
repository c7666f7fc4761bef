"""Sculpting in the window: a brush under the cursor, strokes to be undone, the land written to a file.

Tables follow each dab on the GPU, so the promise holds while one sculpts; light follows when the stroke is done.
"""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

import numpy as np

from ..brush import TOOLS, Brush, Sculptor, places
from ..heightmap import Heightmap
from ..renderer import Renderer
from ..writers import as_options, format_of, write_heightmap

STEP = 2**0.25  # of radius and strength
DAB_S = 0.1  # between two dabs of a brush that is held still
_SHARES = ("smooth", "flatten")  # tools whose strength is a share


class Editing:
    """A brush in hand.

    Attributes
    ----------
    tool, radius_m
        As `Brush` takes them.
    strength_m, share
        Of tools that move the ground, and of those that go a share of the way.
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
        self._sculptor = Sculptor(renderer)
        self._last: np.ndarray | None = None
        self._dabbed_s = float("-inf")

    @property
    def brush(self) -> Brush:
        """The brush as it is held."""
        strength = self.share if self.tool in _SHARES else self.strength_m
        return Brush(self.tool, self.radius_m, strength, azimuth_deg=self.azimuth_deg)

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
        self._sculptor.begin()
        self._dab(place[0], place[1], now_s)
        self._last = place

    def move(self, place: np.ndarray, now_s: float) -> None:
        """The brush is drawn on, or held: dabs lie closely however fast it was."""
        assert self._last is not None
        start, end = (float(self._last[0]), float(self._last[1])), (float(place[0]), float(place[1]))
        if start == end and now_s - self._dabbed_s < DAB_S:
            return
        for x, y in places(start, end, 0.3 * self.radius_m):
            self._dab(x, y, now_s)
        self._last = place

    def end(self) -> None:
        """The button comes up: the light may follow."""
        self._last = None
        self._sculptor.end()

    def undo(self) -> bool:
        """Take the last stroke back; False if there is none."""
        return self._again(self._sculptor.undo)

    def redo(self) -> bool:
        """Do the last one that was undone again; False if there is none."""
        return self._again(self._sculptor.redo)

    def _again(self, step: Any) -> bool:
        done = bool(step())
        self.edited |= done
        self._sculptor.end()
        return done

    def _dab(self, x: float, y: float, now_s: float) -> None:
        self.edited |= self._sculptor.dab(self.brush, float(x), float(y)) is not None
        self._dabbed_s = now_s


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
