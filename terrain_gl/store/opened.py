"""A store as a map: heights and pages are read when they are needed."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from ..basics.exceptions import TerrainError
from ..pages.map import Page, PagedMap, PageKey, PostsOnDemand
from ..pages.marks import known
from .format import Arrays, georeference_of, pyramid_of, read_about
from .pyramid import StoreSizes
from .tiles import Checks, Tiles

OF_TILES = 0.25  # share of `memory_bytes` for the most recently read tiles


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
        self.voids = about["voids"]
        self.is_marked = self.voids > 0 or about["has_water"]
        self.sea_m = about["sea_m"]
        checks = Checks(self.arrays.pyramid, self.is_marked, self.arrays.read_checks())
        if checks.sha256 != about["checks_sha256"]:
            raise TerrainError(f"{os.fspath(path)}: its list of checksums is damaged: build it again")
        self.tiles = Tiles(self.arrays, checks, self._most_bytes)
        self.name = os.fspath(path)
        self.tile = self.arrays.pyramid.tile
        self.top = self.arrays.pyramid.top
        self.spacing_m = about["spacing_m"][0], about["spacing_m"][1]
        self.range_m = self.quantised_m = about["range_m"][0], about["range_m"][1]
        self.georeference = georeference_of(about)
        self.look = about["look"]
        self.assumes_spacing = about["assumes_spacing"]
        self.of_earth = about["of_earth"]
        self.opened = None
        self.scales = (1.0, 0.0)
        self.notes = tuple(about["notes"])
        self.heights = LazyHeights(self.tiles, self.arrays.pyramid, self.voids > 0)  # type: ignore[assignment]

    @classmethod
    def open(cls, path: str | os.PathLike[str], *_: Any, **__: Any) -> StoredMap:
        """Open a store."""
        return cls(path)

    @property
    def _most_bytes(self) -> int:
        return int(OF_TILES * self.memory_bytes)

    def limit(self, gpu_bytes: int, memory_bytes: int) -> None:
        """Set the limits of the GPU memory for pages, and of this process's memory for tiles."""
        self.gpu_bytes = gpu_bytes
        self.memory_bytes = memory_bytes
        self.tiles.most_bytes = self._most_bytes

    @property
    def identity(self) -> str:
        """The hash of all heights."""
        return str(self.about["sha256"])

    def page(self, key: PageKey) -> Page:
        """Read a page."""
        level, row, col = key
        side = self.tile
        rows, cols = self.nodes(level)
        ends = min((row + 1) * side, rows), min((col + 1) * side, cols)
        nodes = slice(row * side, ends[0]), slice(col * side, ends[1])
        posts = _one_more(nodes[0]), _one_more(nodes[1])
        heights = self.tiles.area("heights", level, posts)
        marks = self.lattice_marks(level, *posts)
        if level == 0:
            return Page(heights, np.zeros((0, 0), np.uint32), np.zeros((2, 0, 0), np.uint16), marks)
        errors = self.tiles.area("errors", level, nodes)
        return Page(heights, errors, self.tiles.area("ranges", level, nodes), marks)

    def lattice_heights(self, level: int, rows: slice, cols: slice) -> np.ndarray:
        """Heights of posts of a level's lattice, voids filled."""
        return self.tiles.area("heights", level, (rows, cols))

    def lattice_marks(self, level: int, rows: slice, cols: slice) -> np.ndarray | None:
        """Marks of posts of a level's lattice; None for a map without marks."""
        return self.tiles.area("marks", level, (rows, cols)) if self.is_marked else None


def _one_more(nodes: slice) -> slice:
    """The posts at the corners of nodes."""
    return slice(nodes.start, nodes.stop + 1)


class LazyHeights(PostsOnDemand):
    """All posts of a store, as an array, NaN where void. A slice or an index reads the tiles that it needs."""

    def __init__(self, tiles: Tiles, pyramid: StoreSizes, has_voids: bool) -> None:
        self._tiles = tiles
        self._has_voids = has_voids
        self.shape = pyramid.posts(0)
        self._side = pyramid.tile

    def __getitem__(self, index: Any) -> Any:
        """Posts at (rows, columns): two slices, two numbers, or two arrays of numbers."""
        rows, cols = index
        if isinstance(rows, slice) and isinstance(cols, slice):
            where = [slice(*s.indices(n)) for s, n in zip((rows, cols), self.shape, strict=True)]
            heights = self._tiles.area("heights", 0, (where[0], where[1]))
            return known(heights, self._tiles.area("marks", 0, (where[0], where[1]))) if self._has_voids else heights
        row, col = np.broadcast_arrays(rows, cols)
        found = np.empty(row.shape, np.float32)
        tiles = np.stack([row // self._side, col // self._side], -1)
        for at in np.unique(tiles.reshape(-1, 2), axis=0):
            mine = (tiles == at).all(-1)
            tile = self._tiles.tile(("heights", 0, int(at[0]), int(at[1])))
            if self._has_voids:
                tile = known(tile, self._tiles.tile(("marks", 0, int(at[0]), int(at[1]))))
            found[mine] = tile[row[mine] % self._side, col[mine] % self._side]
        return found if found.ndim else found[()]
