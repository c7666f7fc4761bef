"""A map on its way to the screen: read in a thread, its tables built in portions between frames.

OpenGL belongs to one thread, so only the reading has one of its own; nothing here ever waits.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass

import moderngl
import numpy as np

from ..camera import Camera
from ..exceptions import TerrainError
from ..heightmap import Heightmap
from ..maps import open_map
from ..renderer import Renderer
from ..shade import SUN
from .pace import Pace

COARSE = 193  # posts a side of what is shown while the tables of a larger map are built
_READING = 0.3  # share of the progress bar


@dataclass(frozen=True)
class Opened:
    """A map as it was read.

    Attributes
    ----------
    camera, sun, camera_given
        The view in which it is first seen, and whether somebody asked for just that one.
    key
        What the window remembers it by: a bundled map's name, or a file's path.
    """

    heightmap: Heightmap
    camera: Camera
    sun: tuple[float, float] = SUN
    key: str = ""
    camera_given: bool = False


Progress = Callable[[float], None]
Opener = Callable[[Progress], Opened]


class CancelledError(Exception):
    """Nobody wants the map any more."""


def file_opener(path: str) -> Opener:
    """How a file is opened that was dropped on the window: by what it says itself."""

    def opened(progress: Progress) -> Opened:
        heightmap, known = open_map(path, progress=progress)
        if known:
            return Opened(heightmap, known.camera, known.sun, known.name)
        return Opened(heightmap, Camera.default(heightmap), key=path)

    return opened


class Loading:
    """One map on its way.

    Parameters
    ----------
    name
        What messages call it.
    opener
        Reads it, in a thread; is given a function to be told the part done, whose exceptions end the reading.

    Attributes
    ----------
    opened
        The map, once it is read.
    renderer
        What draws it, once its tables are built.
    error
        Why there will be none.
    """

    def __init__(self, name: str, opener: Opener) -> None:
        self.name, self._opener = name, opener
        self.opened: Opened | None = None
        self.renderer: Renderer | None = None
        self.error: Exception | None = None
        self._building: Renderer | None = None
        self._read = self._built = 0.0
        self._cancelled = False
        self._thread = threading.Thread(target=self._open, name=f"reading {name}")
        self._thread.start()

    @property
    def progress(self) -> float:
        """Part done, 0 to 1."""
        return _READING * self._read + (1 - _READING) * self._built

    @property
    def text(self) -> str:
        """What is being done, in a few words."""
        doing = "building the tables of" if self.opened else "reading"
        return f"{doing} {self.name}: {self.progress:.0%}"

    def step(self, ctx: moderngl.Context, size: tuple[int, int], pace: Pace) -> None:
        """Build on for a while; at least one portion."""
        if self.opened is None or self.renderer or self.error:
            return
        try:
            self._building = self._building or Renderer(self.opened.heightmap, size, ctx=ctx, build=False)
            if pace.go_on(self._building.building, self._tell_built):
                self.renderer, self._building = self._building, None
        except (TerrainError, MemoryError) as error:
            self._building, self.error = None, error

    def take(self) -> Renderer:
        """The renderer; from now on it is the caller's to release."""
        renderer, self.renderer = self.renderer, None
        assert renderer
        return renderer

    def cancel(self) -> None:
        """Stop, and give back what was made; a thread that still reads ends soon, and the program waits for it."""
        self._cancelled = True
        if self._building:
            self._building.building.close()
            self._building = None
        if self.renderer:
            self.renderer.release()
            self.renderer = None

    def join(self) -> None:
        """Wait for the thread: while it reads a picture, it keeps libraries from writing to standard error."""
        self._thread.join()

    def _open(self) -> None:
        try:
            self.opened = self._opener(self._tell)
        except (TerrainError, OSError, MemoryError) as error:
            self.error = error
        except CancelledError:
            pass
        except Exception as error:  # a thread's traceback would tell nobody what to do
            self.error = TerrainError(f"{self.name}: cannot be read ({type(error).__name__}: {error})")

    def _tell(self, part: float) -> None:
        if self._cancelled:
            raise CancelledError
        self._read = part

    def _tell_built(self, part: float) -> None:
        self._built = part


def coarse(heightmap: Heightmap) -> Heightmap | None:
    """The same land with fewer posts, if there are so many that building their tables takes time."""
    if max(heightmap.rows, heightmap.cols) <= 4 * COARSE:
        return None
    rows, cols = (_spread(n) for n in (heightmap.rows, heightmap.cols))
    east, north = heightmap.extent_m
    heights = heightmap.heights[np.ix_(rows, cols)]
    if np.isnan(heights).all():
        return None
    return Heightmap(heights, (east / (len(cols) - 1), north / (len(rows) - 1)), heightmap.name)


def _spread(n: int) -> np.ndarray:
    """Indices from 0 to n − 1, at most `COARSE` of them."""
    return np.round(np.linspace(0, n - 1, min(n, COARSE))).astype(int)
