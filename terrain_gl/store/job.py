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


class Task(NamedTuple):
    """One task: a phase, a level, and the row and column of a shard."""

    phase: str
    level: int
    row: int
    col: int


@dataclass(frozen=True)
class BuildJob:
    """Data that all tasks of a build share.

    Attributes
    ----------
    path
        The store's folder.
    fill_m
        A height for all void posts, which then are land; None if they stay voids.
    look, assumes_spacing
        Attributes of the map: `Heightmap`.
    range_m
        Lowest and highest height; None until all heights are read.
    voids
        The number of voids; None until all heights are read.
    has_water
        Whether water was found in the map's heights.
    """

    path: str
    pyramid: StoreSizes
    source: WindowedRaster
    spacing_m: Spacing
    fill_m: float | None
    look: str = "auto"
    assumes_spacing: bool = False
    range_m: tuple[float, float] | None = None
    voids: int | None = None
    has_water: bool = False

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
        self.arrays.write(name, level, where, values)
        noted = checksums(values, self.pyramid.tile).tolist()
        return {"checks": [[name, level, where[0].start, where[1].start, noted]]}

    @property
    def parts(self) -> Path:
        """Folder of the files by which tasks pass on results."""
        return Path(self.path) / WORK / "parts"


def write_part(path: Path, values: np.ndarray | dict[str, np.ndarray]) -> None:
    """Write a file for other tasks: one array, or several with names. It appears only when it is complete."""
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_suffix(".partial")
    with open(beside, "wb") as file:
        if isinstance(values, dict):
            np.savez(file, **values)  # type: ignore[arg-type]
        else:
            np.save(file, values)
    os.replace(beside, path)
