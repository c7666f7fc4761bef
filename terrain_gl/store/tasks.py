"""The tasks of a build: each writes whole shards, and depends only on finished phases.

    heights 0     read a window of the source, check it, write it
    heights l     every other post of level l − 1
    errors 0      records of all nodes over one shard of posts; those of coarse levels go to a file of their own
    errors l      a shard of a coarse level, from these files

A killed task leaves its shard unchanged or complete; the task is done again.
"""

from __future__ import annotations

import errno
import hashlib
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..basics.exceptions import TerrainError
from ..heightmap import MAX_HEIGHT_M
from ..pages.crop import APRON, Records, records_of
from ..readers.raster import Spacing
from ..readers.windows import WindowedRaster
from .format import Arrays
from .pyramid import Area, StoreSizes, area, areas
from .tiles import checksums

WORK = ".build"  # folder of a build that is not finished
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


class Task(NamedTuple):
    """One task: a phase, its level, row and column of the shard."""

    phase: str
    level: int
    row: int
    col: int


@dataclass(frozen=True)
class BuildJob:
    """What all tasks of a build share.

    Attributes
    ----------
    path
        The store's folder.
    fill_m
        The height of void posts; None to refuse them.
    look, assumes_spacing
        Attributes of the map: `Heightmap`.
    range_m
        Lowest and highest height; None until all heights are read.
    """

    path: str
    pyramid: StoreSizes
    source: WindowedRaster
    spacing_m: Spacing
    fill_m: float | None
    look: str = "auto"
    assumes_spacing: bool = False
    range_m: tuple[float, float] | None = None

    @property
    def arrays(self) -> Arrays:
        """The store's arrays."""
        return Arrays(self.path, self.pyramid)

    def write(self, name: str, level: int, where: Area, values: np.ndarray) -> dict[str, Any]:
        """Write whole shards; returns what is noted of their tiles: field, level, first row and column, checksums."""
        self.arrays.write(name, level, where, values)
        noted = checksums(values, self.pyramid.tile).tolist()
        return {"checks": [[name, level, where[0].start, where[1].start, noted]]}

    @property
    def parts(self) -> Path:
        """Folder of the coarse records of each shard of posts."""
        return Path(self.path) / WORK / "parts"


def phases(pyramid: StoreSizes) -> Iterator[list[Task]]:
    """All tasks, phase by phase; the tasks of a phase do not depend on each other."""
    for level in range(pyramid.top + 1):
        yield [Task("heights", level, *at) for at in areas(pyramid.posts(level), pyramid.shard)]
    yield [Task("errors", 0, *at) for at in areas(pyramid.nodes(0), pyramid.shard)]
    for level in range(pyramid.fine + 1, pyramid.top + 1):
        yield [Task("errors", level, *at) for at in areas(pyramid.nodes(level), pyramid.shard)]


def perform(job: BuildJob, task: Task) -> dict[str, Any]:
    """Do one task; returns what the build must know about its result.

    Raises
    ------
    TerrainError
        The source cannot be read, has voids, or the disk is full.
    """
    doing = {
        ("heights", False): read_source,
        ("heights", True): thin_out,
        ("errors", False): measure,
        ("errors", True): gather,
    }
    try:
        return doing[task.phase, task.level > 0](job, task)
    except OSError as error:
        reason = "the disk is full" if error.errno in _FULL else f"cannot write ({error.strerror or error})"
        raise TerrainError(f"{job.path}: {reason}: make room, and run the same command again to go on") from None


def read_source(job: BuildJob, task: Task) -> dict[str, Any]:
    """Write a window of the source; returns its range, its number of voids, and the hash of its heights."""
    pyramid = job.pyramid
    where = area(pyramid.posts(0), pyramid.shard, (task.row, task.col))
    heights = np.ascontiguousarray(job.source.read(*where), np.float32)
    void = np.isnan(heights)
    voids = int(np.count_nonzero(void))
    if voids and job.fill_m is None:
        row, col = (first.start + int(at) for first, at in zip(where, np.argwhere(void)[0], strict=True))
        raise TerrainError(
            f"{job.source.name}: has voids, as at row {row}, column {col}: fill them first, "
            "or give all of them one height with --fill"
        )
    heights[void] = job.fill_m
    low, high = float(heights.min()), float(heights.max())
    if max(-low, high) > MAX_HEIGHT_M:
        raise TerrainError(
            f"{job.source.name}: heights run from {low:.9g} to {high:.9g} m, beyond ±{MAX_HEIGHT_M:g}: "
            "name the no-data value (--nodata) or scale them (--z-scale)"
        )
    noted = job.write("heights", 0, where, heights)
    return {"range_m": [low, high], "voids": voids, "sha256": hashlib.sha256(heights.tobytes()).hexdigest()} | noted


def thin_out(job: BuildJob, task: Task) -> dict[str, Any]:
    """Write a level's heights: every other post of the finer level, and the last one of each row and column."""
    pyramid = job.pyramid
    arrays = job.arrays
    where = area(pyramid.posts(task.level), pyramid.shard, (task.row, task.col))
    finer = pyramid.posts(task.level - 1)
    index = [np.minimum(2 * np.arange(s.start, s.stop), n - 1) for s, n in zip(where, finer, strict=True)]
    rows, cols = (slice(int(i[0]), int(i[-1]) + 1) for i in index)
    heights = arrays.read("heights", task.level - 1, (rows, cols))
    return job.write("heights", task.level, where, heights[np.ix_(index[0] - rows.start, index[1] - cols.start)])


def measure(job: BuildJob, task: Task) -> dict[str, Any]:
    """Write the error records of all nodes over a shard of posts."""
    assert job.range_m is not None
    pyramid = job.pyramid
    arrays = job.arrays
    at = (task.row, task.col)
    heights = arrays.read("heights", 0, area(pyramid.posts(0), pyramid.shard, at, beyond=APRON))
    found = records_of(heights, job.spacing_m, job.range_m, pyramid.top)
    part: dict[str, np.ndarray] = {}
    noted: dict[str, Any] = {"checks": []}
    for level, records in enumerate(found, 1):
        where = _nodes_over(pyramid, level, at)
        rows, cols = (s.stop - s.start for s in where)
        mine = Records(records.errors[:rows, :cols], records.ranges[:, :rows, :cols])
        for name, values in mine._asdict().items():
            if level <= pyramid.fine:
                noted["checks"] += job.write(name, level, where, values)["checks"]
            else:
                part[f"{name}{level}"] = values
    if part:
        _write_part(job.parts / f"{task.row}.{task.col}.npz", part)
    return noted


def gather(job: BuildJob, task: Task) -> dict[str, Any]:
    """Write a shard of a coarse level, from the files of the shards of posts under it."""
    pyramid = job.pyramid
    where = area(pyramid.nodes(task.level), pyramid.shard, (task.row, task.col))
    side = pyramid.shard >> task.level  # nodes of a part
    rows, cols = (s.stop - s.start for s in where)
    whole = Records(np.zeros((rows, cols), np.uint32), np.zeros((2, rows, cols), np.uint16))
    for row in range(where[0].start // side, -(-where[0].stop // side)):
        for col in range(where[1].start // side, -(-where[1].stop // side)):
            y, x = row * side - where[0].start, col * side - where[1].start
            with np.load(job.parts / f"{row}.{col}.npz") as part:
                for name, values in whole._asdict().items():
                    mine = part[f"{name}{task.level}"]
                    values[..., y : y + mine.shape[-2], x : x + mine.shape[-1]] = mine
    written = [job.write(name, task.level, where, values)["checks"] for name, values in whole._asdict().items()]
    return {"checks": sum(written, [])}


def _nodes_over(pyramid: StoreSizes, level: int, at: tuple[int, int]) -> Area:
    """The nodes of a level over a shard of posts."""
    return area(pyramid.nodes(level), pyramid.shard >> level, at)


def _write_part(path: Path, values: dict[str, np.ndarray]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_suffix(".partial")
    with open(beside, "wb") as file:
        np.savez(file, **values)  # type: ignore[arg-type]
    os.replace(beside, path)
