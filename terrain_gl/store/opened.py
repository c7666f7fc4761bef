"""A store as a map: heights and pages are read when they are needed."""

from __future__ import annotations

import os
import threading
from collections import OrderedDict
from typing import Any

import numpy as np

from ..heightmap import Heightmap
from ..pages import FINEST_RECORD, Page, PagedMap, PageKey
from .format import Arrays, MissingTileError, georeference_of, pyramid_of, read_about

KEPT = 256  # most tiles of heights that stay in memory
COARSE_POSTS = 1 << 20  # most posts of the coarse map from which a first view is chosen


class StoredMap(PagedMap):
    """An opened store.

    Parameters
    ----------
    path
        Its folder.

    Attributes
    ----------
    about
        Its description.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        about = self.about = read_about(path)
        self.arrays = Arrays(path, pyramid_of(about))
        self.name = os.fspath(path)
        self.tile, self.top = self.arrays.pyramid.tile, self.arrays.pyramid.top
        self.spacing_m = about["spacing_m"][0], about["spacing_m"][1]
        self.range_m = self.quantised_m = about["range_m"][0], about["range_m"][1]
        self.georeference = georeference_of(about)
        self.voids, self.look, self.assumes_spacing = 0, "auto", False
        self.opened, self.scales, self.notes = None, (1.0, 0.0), ()
        self.heights = LazyHeights(self.arrays)  # type: ignore[assignment]

    @classmethod
    def open(cls, path: str | os.PathLike[str], *_: Any, **__: Any) -> StoredMap:
        """Open a store."""
        return cls(path)

    def coarse(self) -> Heightmap:
        """A coarse map for choosing a view: the finest level with at most a million posts."""
        level = 0
        while level < self.top and np.prod(self.arrays.pyramid.posts(level)) > COARSE_POSTS:
            level += 1
        while True:
            rows, cols = self.arrays.pyramid.posts(level)
            try:
                heights = self.arrays.read("heights", level, (slice(0, rows), slice(0, cols)))
                break
            except MissingTileError:  # a coarser level serves as well
                if level == self.top:
                    raise
                level += 1
        (width, depth) = self.extent_m
        return Heightmap(heights, (width / (cols - 1), depth / (rows - 1)), self.name)

    def page(self, key: PageKey) -> Page:
        """Read a page."""
        level, row, col = key
        side, (rows, cols) = self.tile, self.nodes(level)
        ends = min((row + 1) * side, rows), min((col + 1) * side, cols)
        nodes = slice(row * side, ends[0]), slice(col * side, ends[1])
        heights = self.arrays.read("heights", level, tuple(slice(s.start, s.stop + 1) for s in nodes))  # type: ignore[arg-type]
        if level == 0:
            return Page(heights, np.zeros((FINEST_RECORD, 0, 0), np.uint32), np.zeros((2, 0, 0), np.uint16))
        errors = self.arrays.read("errors", level, nodes, slice(0, FINEST_RECORD))
        return Page(heights, errors, self.arrays.read("ranges", level, nodes))


class LazyHeights:
    """All posts of a store, as an array. A slice or an index reads the tiles that it needs."""

    dtype, ndim = np.dtype(np.float32), 2

    def __init__(self, arrays: Arrays) -> None:
        self._arrays, self.shape = arrays, arrays.pyramid.posts(0)
        self._tiles: OrderedDict[tuple[int, int], np.ndarray] = OrderedDict()
        self._lock = threading.Lock()

    @property
    def size(self) -> int:
        """Posts."""
        return self.shape[0] * self.shape[1]

    @property
    def nbytes(self) -> int:
        """Bytes that all posts would take in memory."""
        return 4 * self.size

    def __getitem__(self, index: Any) -> Any:
        """Posts at (rows, columns): two slices, two numbers, or two arrays of numbers."""
        rows, cols = index
        if isinstance(rows, slice) and isinstance(cols, slice):
            return self._window(*(slice(*s.indices(n)) for s, n in zip((rows, cols), self.shape, strict=True)))
        row, col = np.broadcast_arrays(rows, cols)
        found = np.empty(row.shape, np.float32)
        tiles = np.stack([row // self._side, col // self._side], -1)
        for at in np.unique(tiles.reshape(-1, 2), axis=0):
            mine = (tiles == at).all(-1)
            tile = self._tile((int(at[0]), int(at[1])))
            found[mine] = tile[row[mine] % self._side, col[mine] % self._side]
        return found if found.ndim else found[()]

    @property
    def _side(self) -> int:
        return self._arrays.pyramid.tile

    def _window(self, rows: slice, cols: slice) -> np.ndarray:
        found = np.empty((max(0, rows.stop - rows.start), max(0, cols.stop - cols.start)), np.float32)
        side = self._side
        for y in range(rows.start // side, -(-rows.stop // side)):
            for x in range(cols.start // side, -(-cols.stop // side)):
                tile = self._tile((y, x))
                top, left = max(rows.start, y * side), max(cols.start, x * side)
                end, right = min(rows.stop, y * side + tile.shape[0]), min(cols.stop, x * side + tile.shape[1])
                part = tile[top - y * side : end - y * side, left - x * side : right - x * side]
                found[top - rows.start : end - rows.start, left - cols.start : right - cols.start] = part
        return found

    def _tile(self, at: tuple[int, int]) -> np.ndarray:
        with self._lock:
            if at in self._tiles:
                self._tiles.move_to_end(at)
                return self._tiles[at]
        rows, cols = (slice(i * self._side, min((i + 1) * self._side, n)) for i, n in zip(at, self.shape, strict=True))
        tile = self._arrays.read("heights", 0, (rows, cols))
        with self._lock:
            self._tiles[at] = tile
            while len(self._tiles) > KEPT:
                self._tiles.popitem(last=False)
        return tile
