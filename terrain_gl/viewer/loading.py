"""Load a map: read it in a thread, then build its tables in steps between frames.

Only reading has a thread, because OpenGL belongs to one thread. Nothing here blocks.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from concurrent.futures import CancelledError
from dataclasses import dataclass, replace
from functools import partial

import moderngl
import numpy as np

from ..basics.exceptions import TerrainError
from ..basics.limits import is_too_large
from ..camera import Camera
from ..files.maps import open_map, sample
from ..files.views import standard_sun, standard_view
from ..heightmap import Heightmap
from ..readers import Reading, open_raster
from ..renderer import Renderer
from ..renderer.overlay import Overlay
from ..shade.picture import SUN
from ..store import StoredMap, cache, is_store
from .frame_budget import FrameBudget
from .window_state import Size

PREVIEW_POSTS = 193  # posts along the longer side of a preview
_READING = 0.3  # part of the progress bar for reading
_PREVIEWING = 0.1  # the part after it, for a preview


Progress = Callable[[float], None]
Opener = Callable[[Progress], "Opened"]


@dataclass(frozen=True)
class Opened:
    """A map as it was read."""

    heightmap: Heightmap
    camera: Camera  # the first view
    sun: tuple[float, float] = SUN  # azimuth and elevation in degrees
    key: str = ""  # the window remembers the map by it: a bundled map's name, or a file's path
    camera_given: bool = False  # whether the user chose this camera
    overlays: tuple[Overlay, ...] = ()
    offer: str = ""  # for a coarse sample of a raster that needs a store, a line that offers the store
    rest: Opener | None = None  # reads the map itself, if this is a coarse sample that is shown meanwhile
    note: str = ""  # a line for the user on how the map was read


def file_opener(path: str) -> Opener:
    """A function that opens a bundled map, or a file with the scale that the file gives."""

    def opened(progress: Progress) -> Opened:
        if is_store(path):
            return _first_seen(StoredMap(path), path)
        raster = open_raster(path) if os.path.isfile(path) else None
        rows, cols = raster.shape[:2] if raster else (0, 0)
        huge = is_too_large(rows, cols)
        pays = rows * cols >= cache.PAYS_POSTS and cache.is_possible()
        if huge or (pays and raster is not None and raster.has_windows):
            few, offer = sample(path, Reading())
            seen = _first_seen(few, path)
            return replace(seen, offer=offer) if huge else replace(seen, rest=partial(_from_cache, path))
        if pays:
            whole = _from_cache(path, progress)
            told = f"{os.path.basename(path)} is drawn from a store; Hold in memory, under Map, reads the file"
            return replace(whole, note=whole.note or told)
        heightmap, known = open_map(path, progress=progress, raster=raster)
        return Opened(heightmap, known.camera, known.sun, known.name) if known else _first_seen(heightmap, path)

    return opened


def _first_seen(heightmap: Heightmap, path: str) -> Opened:
    """A map with its standard view."""
    seen = heightmap.coarse()
    return Opened(heightmap, standard_view(seen), standard_sun(seen), os.path.realpath(path))


def _from_cache(path: str, progress: Progress) -> Opened:
    """A raster from its store, which is made at first use; from memory, with a note, if the store cannot be made."""
    try:
        stored = cache.stored(path, Reading(), None, progress)
        stored.opened = {"path": path}
        return _first_seen(stored, path)
    except TerrainError as error:
        note = f"{error}; {os.path.basename(path)} is held in memory instead"
        return replace(_first_seen(open_map(path, progress=progress)[0], path), note=note)


def in_a_line(error: Exception, what: str) -> Exception:
    """The error, if its text is meant for users; else an error that says what failed, in a line."""
    if isinstance(error, TerrainError | OSError | MemoryError):
        return error
    return TerrainError(f"{what} ({type(error).__name__}: {error})")


class LoadJob:
    """Reads one map and builds its tables.

    Parameters
    ----------
    name
        The map's name in messages.
    opener
        Reads the map, in a thread. It is called with a function that takes the progress, 0 to 1. If this function
        raises an exception, reading ends.
    doing
        What it does, in messages.
    """

    def __init__(self, name: str, opener: Opener, doing: str = "reading") -> None:
        self.name = name
        self._doing = doing
        self._opener = opener
        self.sample: Opened | None = None  # a coarse sample of the map, if there is one to be shown meanwhile
        self.opened: Opened | None = None  # the map, once it is read
        self.renderer: Renderer | None = None  # draws the map, once its tables are built
        self.error: Exception | None = None  # why the map cannot be shown
        self._building: Renderer | None = None
        self._few: Renderer | None = None  # a preview that is being built
        self._read = self._previewed = self._built = 0.0
        self._cancelled = False
        self._thread = threading.Thread(target=self._open, name=f"reading {name}")
        self._thread.start()

    @property
    def previews(self) -> bool:
        """Whether a preview is being built."""
        return self._few is not None

    @property
    def progress(self) -> float:
        """Share that is done, 0 to 1."""
        if self.sample and not self.opened:  # the map's store is being made, and tables are part of a store
            return self._read
        before = _READING * self._read + _PREVIEWING * self._previewed
        return before + (1 - before) * self._built

    @property
    def text(self) -> str:
        doing = "building the tables of" if self.opened else "making a store of" if self.sample else self._doing
        doing = "preparing a preview of" if self._few else doing
        return f"{doing} {self.name}: {self.progress:.0%}"

    def step(self, ctx: moderngl.Context, size: Size, budget: FrameBudget) -> None:
        """Build tables for a while, at least one step."""
        if self.opened is None or self.renderer or self.error:
            return
        try:
            self._building = self._building or Renderer(self.opened.heightmap, size, ctx=ctx, build=False)
            if budget.run(self._building.build_steps, self._tell_built):
                self.renderer = self._building
                self._building = None
        except Exception as error:  # steps that have failed cannot go on
            self._building = None
            self.error = in_a_line(error, f"{self.name}: its tables cannot be built")

    def preview_step(self, ctx: moderngl.Context, size: Size, budget: FrameBudget) -> tuple[Renderer, Opened] | None:
        """Build a preview for a while, at least one step; returns it when it is built, with what it is a sample of."""
        opened = self.sample or self.opened
        if opened is None or self.error:
            return None
        few = opened.heightmap if self.sample else preview(opened.heightmap)
        if few is None:
            return None
        try:
            self._few = self._few or Renderer(few, size, ctx=ctx, build=False)
            if not budget.run(self._few.build_steps, self._tell_previewed):
                return None
        except Exception as error:
            self._few = None
            self.error = in_a_line(error, f"{self.name}: its preview cannot be built")
            return None
        self._previewed = 1.0
        built, self._few = self._few, None
        return built, opened

    def cancel(self) -> None:
        """Stop, and release unfinished tables. A thread that is still reading ends soon."""
        self._cancelled = True
        for unfinished in filter(None, (self._building, self._few)):
            unfinished.build_steps.close()
        self._building = self._few = None
        if self.renderer:
            self.renderer.release()
            self.renderer = None

    def join(self) -> None:
        """Wait for the thread. While it reads an image, standard error is silent."""
        self._thread.join()

    def _open(self) -> None:
        try:
            opened = self._opener(self._tell_read)
            if opened.rest:
                self.sample = opened
                opened = opened.rest(self._tell_read)
            self.opened = opened
        except CancelledError:
            pass
        except Exception as error:  # the user sees one line, not a thread's traceback
            self.error = in_a_line(error, f"{self.name}: cannot be read")

    def _tell_read(self, share: float) -> None:
        if self._cancelled:
            raise CancelledError
        self._read = share

    def _tell_previewed(self, share: float) -> None:
        self._previewed = share

    def _tell_built(self, share: float) -> None:
        self._built = share


def preview(heightmap: Heightmap) -> Heightmap | None:
    """A coarse sample of a large map, to be shown while its tables are built; None if the map is small."""
    if max(heightmap.rows, heightmap.cols) <= 4 * PREVIEW_POSTS or heightmap.is_store:
        return None
    shape = heightmap.rows, heightmap.cols
    rows, cols = (np.linspace(0, n - 1, min(n, PREVIEW_POSTS)).round().astype(int) for n in shape)
    east, north = heightmap.extent_m
    heights = heightmap.heights[np.ix_(rows, cols)]
    if np.isnan(heights).all():
        return None
    few = Heightmap(heights, (east / (len(cols) - 1), north / (len(rows) - 1)), heightmap.name)
    few.georeference = heightmap.georeference and heightmap.georeference.resampled(len(cols), len(rows))
    return few


def scaled(heightmap: Heightmap, factor: float, progress: Progress | None = None, added_m: float = 0.0) -> Heightmap:
    """The map with all heights multiplied, and metres added.

    If the map came from a file, the file is read again with another scale and offset. So the map can still be named in
    a command: by its file and these two numbers.
    """
    if heightmap.opened is None:
        again = heightmap.copy(heightmap.heights * np.float32(factor) + np.float32(added_m))
        return again
    scale, offset_m = heightmap.scales
    how = heightmap.opened | {"z_scale": factor * scale, "z_offset_m": factor * offset_m + added_m}
    again = Heightmap.open(**how, progress=progress)
    again.name = heightmap.name
    again.spacing_m = heightmap.spacing_m
    again.look = heightmap.look
    again.of_earth = heightmap.of_earth
    return again
