"""Data that all tasks of a build share, and the files by which they pass on results."""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..basics.rect import Area
from ..readers.raster import Spacing
from ..readers.windows import WindowedRaster
from .format import Arrays
from .pyramid import StoreSizes
from .tiles import checksums

WORK = ".build"  # folder of a build that is not finished
BUILT = ".built"  # its name while it is removed


class Task(NamedTuple):
    """One task: a phase, a level, and the row and column of a shard."""

    phase: str
    level: int
    row: int
    col: int

    @property
    def at(self) -> tuple[int, int]:
        """Row and column of its shard."""
        return self.row, self.col


class Shard(NamedTuple):
    """One shard of an array: its field and level, row and column."""

    name: str
    level: int
    row: int
    col: int


@dataclass(frozen=True)
class BuildJob:
    """Data that all tasks of a build share."""

    path: str  # the store's folder
    pyramid: StoreSizes
    source: WindowedRaster
    spacing_m: Spacing
    fill_m: float | None  # a height for all void posts, which then are land; None if they stay voids
    look: str = "auto"
    assumes_spacing: bool = False
    range_m: tuple[float, float] | None = None  # lowest and highest height; None until all heights are read
    voids: int | None = None  # number of voids; None until all heights are read
    has_water: bool = False  # whether water was found in the map's heights
    whole: frozenset[Shard] = frozenset()  # shards of a store that is mended; they are not written again

    @property
    def is_marked(self) -> bool:
        """Whether the store has marks."""
        return bool(self.voids) or self.has_water

    @property
    def arrays(self) -> Arrays:
        """The store's arrays."""
        return Arrays(self.path, self.pyramid)

    def write(self, name: str, level: int, where: Area, values: np.ndarray) -> dict[str, Any]:
        """Write whole shards; returns the checksums of their tiles, with field, level, first row and column."""
        side = self.pyramid.shard_of(name, level)
        if Shard(name, level, where[0].start // side, where[1].start // side) not in self.whole:
            self.arrays.write(name, level, where, values)
        noted = checksums(values, self.pyramid.tile).tolist()
        return {"checks": [[name, level, where[0].start, where[1].start, noted]]}

    def keep(self, name: str, **values: np.ndarray) -> None:
        """Write a file for other tasks. It appears only when it is complete."""
        path = self._kept(name)
        path.parent.mkdir(parents=True, exist_ok=True)
        beside = path.with_suffix(".partial")
        with open(beside, "wb") as file:
            np.savez(file, **values)  # type: ignore[arg-type]
        os.replace(beside, path)

    def kept(self, name: str) -> Any:
        """A file that a task has written with `keep`: a context manager that gives its arrays."""
        return np.load(self._kept(name))

    def _kept(self, name: str) -> Path:
        return Path(self.path) / WORK / "parts" / f"{name}.npz"
