"""A store as a map: heights and pages are read when they are needed."""

from __future__ import annotations

import os

import numpy as np

from ..basics.exceptions import TerrainError
from ..heightmap import units_for
from ..pages.map import Page, PagedHeights, PagedMap, PageKey
from .format import Arrays, georeference_of, mending, pyramid_of, read_about
from .pyramid import area
from .tiles import Checks, Tiles

OF_TILES = 0.25  # share of `memory_bytes` for the most recently read tiles


class StoredMap(PagedMap):
    """The store in a folder, opened. `about` is its description."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        about = self.about = read_about(path)
        self.arrays = Arrays(path, pyramid_of(about))
        self.voids = about["voids"]
        self.has_water = about["has_water"]
        self.is_marked = self.voids > 0 or self.has_water
        self.sea_m = about["sea_m"]
        checks = Checks(self.arrays.pyramid, self.is_marked, self.arrays.read_checks())
        if checks.sha256 != about["checks_sha256"]:
            raise TerrainError(f"{os.fspath(path)}: its list of checksums is damaged: {mending(path)}")
        self.tiles = Tiles(self.arrays, checks, self._most_bytes)
        self.name = os.fspath(path)
        self.tile = self.arrays.pyramid.tile
        self.top = self.arrays.pyramid.top
        self.spacing_m = about["spacing_m"][0], about["spacing_m"][1]
        self.range_m = about["range_m"][0], about["range_m"][1]
        self.quantised_m = units_for(self.range_m, self.spacing_m)
        self.georeference = georeference_of(about)
        self.look = about["look"]
        self.assumes_spacing = about["assumes_spacing"]
        self.of_earth = about["of_earth"]
        self.opened = None
        self.scales = (1.0, 0.0)
        self.notes = tuple(about["notes"])
        self.values = about.get("values", "metres")
        self.heights = PagedHeights(self, self.arrays.pyramid.posts(0))  # type: ignore[assignment]

    @classmethod
    def open(cls, path: str | os.PathLike[str], *_: object, **__: object) -> StoredMap:
        """Open a store."""
        return cls(path)

    @property
    def _most_bytes(self) -> int:
        return int(OF_TILES * self.memory_bytes)

    def limit(self, gpu_bytes: int, memory_bytes: int) -> None:
        """Set the limits of GPU memory for pages, and of this process's memory for data that is read."""
        self.gpu_bytes = gpu_bytes
        self.memory_bytes = memory_bytes
        self.tiles.most_bytes = self._most_bytes

    @property
    def identity(self) -> str:
        """The hash of all heights."""
        return str(self.about["sha256"])

    def page(self, key: PageKey) -> Page:
        """Read a page."""
        level, *at = key
        nodes = area(self.nodes(level), self.tile, (at[0], at[1]))
        rows, cols = (slice(n.start, n.stop + 1) for n in nodes)
        heights = self.tiles.area("heights", level, (rows, cols))
        marks = self.lattice_marks(level, rows, cols)
        if level == 0:
            return Page(heights, np.zeros((0, 0), np.uint32), np.zeros((2, 0, 0), np.uint16), marks)
        return Page(heights, self.tiles.area("errors", level, nodes), self.tiles.area("ranges", level, nodes), marks)

    def lattice_heights(self, level: int, rows: slice, cols: slice) -> np.ndarray:
        """Heights of posts of a level's lattice, voids filled."""
        return self.tiles.area("heights", level, (rows, cols))

    def lattice_marks(self, level: int, rows: slice, cols: slice) -> np.ndarray | None:
        """Marks of posts of a level's lattice; None for a map without marks."""
        return self.tiles.area("marks", level, (rows, cols)) if self.is_marked else None
