"""Maps that are read window by window, never as a whole: files, mosaics, and objects with `shape` and slices.

A window is (rows, cols) float32 metres with the northern row first, NaN where void.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from terrain_gl.basics.exceptions import TerrainError, UsageError
from terrain_gl.readers import Reading, open_raster, state_of
from terrain_gl.readers.gdal import bands_of, place_of, read_pixels
from terrain_gl.readers.georeference import EVEN, Georeference, Placed, spacing_in_the_middle
from terrain_gl.readers.local import closed_environment, open_layer
from terrain_gl.readers.objects import is_labelled, lazy_array
from terrain_gl.readers.place import Place, check_crs
from terrain_gl.readers.plausible import (
    contradictions,
    guess,
    plausible_spacing,
    sample_of,
    undeclared_voids,
    without,
)
from terrain_gl.readers.raster import Raster, Spacing, both
from terrain_gl.readers.values import AS_STORED, heights_of

_ALL = slice(None)
_SAMPLES = 1024  # posts a side where marks of voids are looked for
_ONE_METRE = "no spacing is given: posts count as 1 m apart; give spacing_m"
_STRIP_POSTS = 1 << 22  # posts that are read at once for a guess
_LEAST_STRIP = 16  # rows


class WindowedRaster:
    """A map that is read window by window."""

    identity: object = None  # JSON on the source: names, sizes, times of files, and how they are read; None if unknown
    is_told = False  # whether the caller has given a scale or an offset of the heights

    def __init__(self, raster: Raster) -> None:
        self._raster = raster
        self.name = raster.name
        self.shape = raster.shape[:2]
        self.spacing_m = raster.spacing_m
        self.georeference: Georeference | None = raster.georeference
        self.notes = raster.notes
        self.values = raster.meaning.words
        self.assumes_spacing = raster.spacing_m is None

    def read(self, rows: slice, cols: slice) -> np.ndarray:
        """The heights of a window that lies on the map."""
        raise NotImplementedError

    def compare_with_the_earth(self, reading: Reading = AS_STORED) -> None:
        """Add notes if the heights of some windows contradict what we take them for."""
        if not reading.is_told:
            self.notes += contradictions(self.read, self.shape, both(self.spacing_m or 1.0), self._raster, reading)


def open_windows(
    paths: Sequence[str | os.PathLike[str]],
    reading: Reading = AS_STORED,
    spacing_m: float | Spacing | None = None,
    progress: Callable[[float], None] | None = None,
) -> WindowedRaster:
    """Open a file, or several files as one mosaic. Missing scale and spacing are guessed, as by `Heightmap.open`.

    `spacing_m` replaces the spacing in the file. `progress` is called with the part of the files that are open.
    `TerrainError` if a file cannot be read, or is not on the grid of the first file.
    """
    files: list[RasterFile] = []
    marks: set[float] = set()
    for path in paths:
        file = RasterFile(os.fspath(path), reading)
        marks.update(file.find_voids())
        files.append(file)
        if progress:
            progress(len(files) / len(paths))
    for file in files:
        file.voids_m = tuple(sorted(marks))
    windows: WindowedRaster
    if len(files) == 1:
        windows = files[0]
        files[0].guess(spacing_m)
    else:
        windows = Mosaic(files)
        windows.compare_with_the_earth(reading)
    windows.notes = reading.unanswered(windows.notes, spacing_m)
    return windows


def identity_of(path: str, reading: Reading) -> list[Any]:
    """Names, sizes and times of a map's files, and how they are read; no file is read, except a mosaic's list."""
    files = [[os.path.basename(name), size, time] for name, size, time in state_of(path)]
    return [os.path.basename(path), files, repr(reading)]


def windows_of(source: Any, name: str) -> Sliced:
    """Windows of a DataArray of xarray, or of any 2-D object with `shape` and slices (numpy, Dask, Zarr, h5py, ...)."""
    if is_labelled(source):
        sliced = Sliced(*lazy_array(source, name))
        sliced.compare_with_the_earth()
        return sliced
    shape = getattr(source, "shape", None)
    if shape is None or len(shape) != 2 or not hasattr(source, "__getitem__"):
        raise UsageError(f"{name}: expected a 2-D array, or an object with shape and slices, got {type(source)}")
    rows, cols = (int(n) for n in shape)
    dtype = np.dtype(getattr(source, "dtype", np.float64))
    return Sliced(source, Raster(name, (rows, cols, 1), dtype))


class Sliced(WindowedRaster):
    """An object with `shape` and slices; each window is computed when it is read."""

    def __init__(self, source: Any, raster: Raster) -> None:
        raster = replace(raster, spacing_m=raster.spacing_m or getattr(source, "spacing_m", None))
        super().__init__(raster)
        self.identity = getattr(source, "identity", None)
        self._source = source

    def guess(self) -> None:
        """Choose a spacing for an array without one, as for files. Lazy arrays get a line, and are not computed."""
        if self.spacing_m is not None:
            return
        notes: tuple[str, ...] = (_ONE_METRE,)
        if isinstance(self._source, np.ndarray):
            strip = max(1, _STRIP_POSTS // self.shape[1])
            _, self.spacing_m, notes = plausible_spacing(sample_of(self.read, self.shape, strip))
        self.notes = self.notes + notes

    def read(self, rows: slice, cols: slice) -> np.ndarray:
        """The heights of a window."""
        values = np.ma.filled(np.ma.asanyarray(np.asanyarray(self._source[rows, cols]), np.float64), np.nan)
        return heights_of(values[..., None], self._raster)


class RasterFile(WindowedRaster):
    """A file that GDAL reads window by window; any other kind of file is held in memory as a whole.

    Each thread, and each process that this object is sent to, opens the file for itself.
    """

    def __init__(self, path: str, reading: Reading = AS_STORED) -> None:
        raster = open_raster(path, reading)
        raster.blocks.close()
        super().__init__(raster)
        self.identity = identity_of(path, reading)
        self.is_told = reading.is_told
        self.path = path
        self.reading = reading
        self.voids_m: tuple[float, ...] = ()
        self._open = threading.local()

    def read(self, rows: slice, cols: slice) -> np.ndarray:
        """The heights of a window."""
        return self._heights(rows, cols)

    def find_voids(self) -> tuple[float, ...]:
        """Find heights that mark voids although the file does not say so, and add notes on them.

        In a file that GDAL reads, a sample of posts is looked at; in any other file, all posts.
        """
        if self.reading.nodata is not None:
            return ()
        few = self.sample((min(self.shape[0], _SAMPLES), min(self.shape[1], _SAMPLES)))
        heights = self._in_strips() if few is None else few
        marks, notes = undeclared_voids(heights, self.reading.scales(self._raster))
        self.notes = self.notes + notes
        return marks

    def guess(self, spacing_m: float | Spacing | None = None) -> None:
        """Guess a scale if the values cannot be metres, and a spacing if none is known; add notes on the heights."""
        if self.reading.is_told:
            return
        known_m = self.spacing_m if spacing_m is None else both(spacing_m)
        found = guess(self.read, self.shape, self._strip, self._raster, self.reading, known_m)
        if found.scale != 1:
            self.reading = replace(self.reading, z_scale=found.scale, z_offset_m=0.0)
        self.spacing_m = found.spacing_m
        self.notes += found.notes

    @property
    def _strip(self) -> int:
        """Number of rows that are read at once: few, because they are in float64, and the map is in float32."""
        return max(_LEAST_STRIP, _STRIP_POSTS // self.shape[1])

    def _in_strips(self) -> np.ndarray:
        heights = np.empty(self.shape, np.float32)
        for first in range(0, self.shape[0], self._strip):
            rows = slice(first, min(first + self._strip, self.shape[0]))
            heights[rows] = self.read(rows, _ALL)
        return heights

    def sample(self, size: tuple[int, int]) -> np.ndarray | None:
        """The heights at (rows, cols) posts spread over the whole map; None if GDAL does not read this file."""
        if not self._raster.has_windows:
            return None
        return self._heights(_ALL, _ALL, size)

    def __getstate__(self) -> dict[str, Any]:
        """Everything except open files, which cannot be sent to another process."""
        return {key: value for key, value in self.__dict__.items() if key != "_open"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """The same file, not open yet."""
        self.__dict__.update(state, _open=threading.local())

    def _heights(self, rows: slice, cols: slice, out: tuple[int, int] | None = None) -> np.ndarray:
        """The heights of a window; with `out`, only so many rows and columns, spread over the window."""
        rows, cols = (slice(*s.indices(n)) for s, n in zip((rows, cols), self.shape, strict=True))
        pixels = self._window(rows, cols, out) if self._raster.has_windows else self._whole()[rows, cols]
        return without(heights_of(pixels, self._raster, self.reading), self.voids_m)

    def _window(self, rows: slice, cols: slice, out: tuple[int, int] | None) -> np.ndarray:
        if not hasattr(self._open, "layer"):
            data, band = open_layer(self.path, self.name, self.reading.trusted, self.reading.band)
            is_south_up = place_of(data, self.name)[0].grid.is_south_up
            self._open.layer = data, bands_of(data, self.name, band), is_south_up
        data, bands, is_south_up = self._open.layer
        start, stop = (
            (self.shape[0] - rows.stop, self.shape[0] - rows.start) if is_south_up else (rows.start, rows.stop)
        )
        with closed_environment():
            pixels = read_pixels(data, self.name, bands, ((start, stop), (cols.start, cols.stop)), out)
        return pixels[::-1] if is_south_up else pixels

    def _whole(self) -> np.ndarray:
        if not hasattr(self._open, "pixels"):
            raster = open_raster(self.path, self.reading)
            self._open.pixels = np.empty(raster.shape, raster.dtype)
            for where, block in raster.blocks:
                self._open.pixels[where] = block
        return self._open.pixels


class Mosaic(WindowedRaster):
    """Files on one grid, in one coordinate system. Where they overlap, the last file that has a height is used."""

    def __init__(self, files: Sequence[RasterFile]) -> None:
        self.files = files
        self._raster = files[0]._raster
        self.identity = [file.identity for file in files]
        # all files get the coordinate system of the first that names one
        first = next((file for file in files if file.georeference and file.georeference.crs), files[0])
        if first.georeference is None:
            raise TerrainError(f"{first.name}: its place is not known: a mosaic needs files with a georeference")
        for file in files:
            check_crs(file, first)
        lefts, tops = np.array([corner_on(file, first) for file in files]).T
        lefts = Place(first.georeference, (1.0, 1.0)).as_neighbours(lefts, np.array([f.shape[1] for f in files]))
        left, top = int(lefts.min()), int(tops.min())
        self._corners = [(int(x) - left, int(y) - top) for x, y in zip(lefts, tops, strict=True)]
        ends = [(x + f.shape[1], y + f.shape[0]) for (x, y), f in zip(self._corners, files, strict=True)]
        self.shape = max(y for _, y in ends), max(x for x, _ in ends)
        grid = first.georeference.grid
        grid = grid._replace(c=grid.c + left * grid.a, f=grid.f + top * grid.e)
        self.georeference = Georeference(grid, first.georeference.crs, (self.shape[1], self.shape[0]))
        self.name = f"{files[0].name} and {len(files) - 1} more"
        self.spacing_m = spacing_in_the_middle(self.georeference, self.name) or first.spacing_m
        self.assumes_spacing = False
        self.is_told = first.is_told
        self.values = first.values
        silent = [file.name for file in files if file.georeference and not file.georeference.crs]
        notes = [note for file in files for note in file.notes]
        if silent and first.georeference.crs:
            notes.append(f"{silent[0]} names no coordinate system: that of {first.name} counts for all files")
        self.notes = tuple(dict.fromkeys(notes))

    def read(self, rows: slice, cols: slice) -> np.ndarray:
        """The heights of a window."""
        heights = np.full((rows.stop - rows.start, cols.stop - cols.start), np.nan, np.float32)
        for file, (x, y) in zip(self.files, self._corners, strict=True):
            across, down = _common(cols, x, file.shape[1]), _common(rows, y, file.shape[0])
            if across is None or down is None:
                continue
            part = file.read(slice(down.start - y, down.stop - y), slice(across.start - x, across.stop - x))
            at = np.s_[
                down.start - rows.start : down.stop - rows.start, across.start - cols.start : across.stop - cols.start
            ]
            np.copyto(heights[at], part, where=~np.isnan(part))
        return heights


def corner_on(file: Placed, first: Placed) -> tuple[int, int]:
    """Column and row of a file's first post on the grid of another map, whose place is known; refuse other grids."""
    assert first.georeference is not None
    mine = file.georeference and file.georeference.grid
    grid = first.georeference.grid
    if mine is None or abs(mine.a / grid.a - 1) > 1e-6 or abs(mine.e / grid.e - 1) > 1e-6:
        raise TerrainError(f"{file.name}: its posts are not {grid.a:g} apart as in {first.name}: resample it first")
    x, y = (mine.c - grid.c) / grid.a, (mine.f - grid.f) / grid.e
    if max(abs(x - round(x)), abs(y - round(y))) > EVEN:
        raise TerrainError(f"{file.name}: its posts are not on the grid of {first.name}: resample it first")
    return round(x), round(y)


def _common(window: slice, first: int, n: int) -> slice | None:
    start, stop = max(window.start, first), min(window.stop, first + n)
    return slice(start, stop) if start < stop else None
