"""The tasks of a build: each writes whole shards, and depends only on finished phases.

    read            read a window of the source, check it, write it; the voids go to a file of their own
    find_water      find the water of the whole map (water.py)
    halve           halve the known heights of a shard a few times       }
    fill_coarsest   fill the coarsest of these levels, of the whole map  }  only if the map has voids (voids.py)
    fill            fill a shard with voids, from the coarsest level on  }
    replace         write the filled shard                               }
    mark            bits of posts and nodes of a shard of a level, if the map has voids or water
    thin_out        every other post of the level below
    measure         records of all nodes over one shard of posts; records of coarse levels go to a file of their own
    gather          a shard of the records of a coarse level, from these files

A killed task leaves its shard either unchanged or complete. The task is then done again.
"""

import errno
import hashlib
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np

from ..basics.exceptions import TerrainError
from ..basics.rect import Area, tiles_over
from ..basics.steps import drain
from ..gpu.layout import VOID
from ..heightmap import MAX_HEIGHT_M, units_for
from ..pages.crop import APRON, Records, record_steps
from ..pages.marks import coarser, marks_of_cells
from . import voids, water
from .job import BuildJob, Task
from .pyramid import StoreSizes, area, areas

_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def of_source(pyramid: StoreSizes) -> list[Task]:
    """The first phase: all heights are read."""
    return [Task("read", 0, *at) for at in areas(pyramid.posts(0), pyramid.shard)]


def of_all(pyramid: StoreSizes) -> list[Task]:
    """The second phase: tasks that need all heights."""
    return [Task("find_water", 0, 0, 0)]


def phases(pyramid: StoreSizes, with_voids: Iterable[Task], is_marked: bool) -> Iterator[list[Task]]:
    """All further tasks, phase by phase. The tasks of a phase do not depend on each other.

    `with_voids` are the tasks of the first phase that found voids; `is_marked`: the store has marks.
    """
    if void := [task._replace(phase="fill") for task in with_voids]:
        yield [task._replace(phase="halve") for task in of_source(pyramid)]
        yield [Task("fill_coarsest", 0, 0, 0)]
        yield void
        yield [task._replace(phase="replace") for task in void]
    if is_marked:
        for level in range(pyramid.top + 1):
            yield [Task("mark", level, *at) for at in areas(pyramid.posts(level), pyramid.shard)]
    for level in range(1, pyramid.top + 1):
        yield [Task("thin_out", level, *at) for at in areas(pyramid.posts(level), pyramid.shard)]
    yield [Task("measure", 0, *at) for at in areas(pyramid.nodes(0), pyramid.shard)]
    for level in range(pyramid.fine + 1, pyramid.top + 1):
        yield [Task("gather", level, *at) for at in areas(pyramid.nodes(level), pyramid.shard)]


def perform(job: BuildJob, task: Task) -> dict[str, Any]:
    """Do one task; returns what the build must know about its result."""
    doing: dict[str, Callable[[BuildJob, Task], dict[str, Any]]] = {
        "read": read,
        "find_water": water.find,
        "halve": voids.halve,
        "fill_coarsest": voids.fill_coarsest,
        "fill": voids.fill,
        "replace": voids.replace,
        "mark": mark_coarser if task.level else mark,
        "thin_out": thin_out,
        "measure": measure,
        "gather": gather,
    }
    try:
        return doing[task.phase](job, task)
    except OSError as error:
        reason = "the disk is full" if error.errno in _FULL else f"cannot write ({error.strerror or error})"
        raise TerrainError(f"{job.path}: {reason}: make room, and run the same command again to go on") from None


def read(job: BuildJob, task: Task) -> dict[str, Any]:
    """Write a window of the source; returns its range, its numbers of voids and of filled posts, and a hash."""
    pyramid = job.pyramid
    where = area(pyramid.posts(0), pyramid.shard, task.at)
    heights = np.ascontiguousarray(job.source.read(*where), np.float32)
    void = np.isnan(heights)
    count = int(np.count_nonzero(void))
    filled = count if job.fill_m is not None else 0
    known = heights[~void]
    heights[void] = 0.0 if job.fill_m is None else job.fill_m  # 0: until the shard is filled
    ends = [float(known.min()), float(known.max())] if known.size else []
    ends += [float(heights[void][0])] if filled else []
    if max(map(abs, ends), default=0.0) > MAX_HEIGHT_M:
        raise TerrainError(
            f"{job.source.name}: heights run from {min(ends):.9g} to {max(ends):.9g} m, beyond ±{MAX_HEIGHT_M:g}: "
            "name the no-data value (--nodata) or scale them (--z-scale)"
        )
    if count > filled:
        voids.note(job, task, void)
    noted = job.write("heights", 0, where, heights)
    water.note(job, task, np.where(void, np.float32(np.nan), heights) if count > filled else heights)
    range_m = [min(ends), max(ends)] if ends else None
    found = {"range_m": range_m, "voids": count - filled, "filled": filled}
    return found | {"sha256": hashlib.sha256(heights.tobytes()).hexdigest()} | noted


def thin_out(job: BuildJob, task: Task) -> dict[str, Any]:
    """Write a level's heights: every other post of the finer level, and the last post of each row and column."""
    where, posts, (rows, cols) = _every_other(job, task)
    heights = job.arrays.read("heights", task.level - 1, (rows, cols))
    return job.write("heights", task.level, where, heights[np.ix_(posts[0] - rows.start, posts[1] - cols.start)])


def mark(job: BuildJob, task: Task) -> dict[str, Any]:
    """Write the marks of the posts of a shard, and of the cells that begin there."""
    pyramid = job.pyramid
    where = area(pyramid.posts(0), pyramid.shard, task.at)
    beyond = area(pyramid.posts(0), pyramid.shard, task.at, beyond=1)
    void = voids.of_area(job, beyond)
    heights = np.where(void, np.float32(np.nan), job.arrays.read("heights", 0, beyond))
    wet = water.at(job, beyond, heights)
    marks = marks_of_cells(void, wet)
    rows, cols = (s.stop - s.start for s in where)
    noted = job.write("marks", 0, where, np.ascontiguousarray(marks[:rows, :cols]))
    rim = [] if wet is None else water.on_rim(pyramid, where, np.where(wet, heights, np.nan)[:rows, :cols])
    return {"water_on_rim": rim} | noted


def mark_coarser(job: BuildJob, task: Task) -> dict[str, Any]:
    """Write a level's marks, computed from the marks of the finer level."""
    where, posts, (rows, cols) = _every_other(job, task, beyond=1)
    marks = job.arrays.read("marks", task.level - 1, (rows, cols))
    finer = job.pyramid.posts(task.level - 1)
    last = finer[0] - 1 - rows.start, finer[1] - 1 - cols.start
    return job.write("marks", task.level, where, coarser(marks, posts[0] - rows.start, posts[1] - cols.start, last))


def _every_other(job: BuildJob, task: Task, beyond: int = 0) -> tuple[Area, list[np.ndarray], Area]:
    """A shard of a level; rows and columns of its posts on the finer level; the area that contains these posts."""
    where = area(job.pyramid.posts(task.level), job.pyramid.shard, task.at)
    finer = job.pyramid.posts(task.level - 1)
    posts = [np.minimum(2 * np.arange(s.start, s.stop), n - 1) for s, n in zip(where, finer, strict=True)]
    rows, cols = (slice(int(p[0]), min(int(p[-1]) + 1 + beyond, n)) for p, n in zip(posts, finer, strict=True))
    return where, posts, (rows, cols)


def measure(job: BuildJob, task: Task) -> dict[str, Any]:
    """Write the error records of all nodes over a shard of posts."""
    assert job.range_m is not None
    pyramid = job.pyramid
    arrays = job.arrays
    posts = area(pyramid.posts(0), pyramid.shard, task.at, beyond=APRON)
    void = (arrays.read("marks", 0, posts) & VOID) > 0 if job.is_marked else None
    heights, units_m = arrays.read("heights", 0, posts), units_for(job.range_m, job.spacing_m)
    found = drain(record_steps(heights, job.spacing_m, units_m, pyramid.top, void))
    part: dict[str, np.ndarray] = {}
    noted: dict[str, Any] = {"checks": []}
    for level, records in enumerate(found, 1):
        where = area(pyramid.nodes(level), pyramid.shard >> level, task.at)
        rows, cols = (s.stop - s.start for s in where)
        mine = Records(records.errors[:rows, :cols], records.ranges[:, :rows, :cols])
        for name, values in mine._asdict().items():
            if level <= pyramid.fine:
                noted["checks"] += job.write(name, level, where, values)["checks"]
            else:
                part[f"{name}{level}"] = values
    if part:
        job.keep(f"records.{task.row}.{task.col}", **part)
    return noted


def gather(job: BuildJob, task: Task) -> dict[str, Any]:
    """Write a shard of a coarse level, from the files of the shards of posts under it."""
    pyramid = job.pyramid
    where = area(pyramid.nodes(task.level), pyramid.shard, task.at)
    rows, cols = (s.stop - s.start for s in where)
    whole = Records(np.zeros((rows, cols), np.uint32), np.zeros((2, rows, cols), np.uint16))
    for (row, col), inside, mine in tiles_over(where, pyramid.shard >> task.level):
        with job.kept(f"records.{row}.{col}") as part:
            for name, values in whole._asdict().items():
                values[(..., *mine)] = part[f"{name}{task.level}"][(..., *inside)]
    written = [job.write(name, task.level, where, values)["checks"] for name, values in whole._asdict().items()]
    return {"checks": sum(written, [])}
