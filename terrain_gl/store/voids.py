"""Fill the voids of a source shard by shard, with the same bits as for a map in memory (`terrain.filling`).

halve            compute the known heights of a shard on coarser levels: each has means of 2 × 2 posts of the last
fill_coarsest    fill the coarsest of these levels, of the whole map: a shard has `SIDE` posts a side there
fill             fill a shard, level by level, from the coarsest down. Each level needs the filled heights of the
                 coarser level, with `AROUND` posts around the shard, and its own known heights, with twice as many
replace          write the filled shard, when no other task needs the unfilled heights
"""

import contextlib
import hashlib
from typing import Any

import numpy as np

from ..basics.rect import Area, tiles_over
from ..terrain.filling import SWEEPS, Filling, pull, push
from .job import BuildJob, Task
from .pyramid import StoreSizes, area

SIDE = 32
AROUND = 16
assert AROUND >= SWEEPS + 2 and SIDE >= 2 * AROUND  # all that a shard needs lies in the shards next to it


def note(job: BuildJob, task: Task, void: np.ndarray) -> None:
    """Store the voids of a shard in a file."""
    job.keep(f"void.{task.row}.{task.col}", void=void)


def of_area(job: BuildJob, where: Area) -> np.ndarray:
    """Voids of an area of posts, (rows, cols) bool."""
    rows, cols = where
    found = np.zeros((rows.stop - rows.start, cols.stop - cols.start), bool)
    for (row, col), mine, part in tiles_over(where, job.pyramid.shard):
        with contextlib.suppress(FileNotFoundError), job.kept(f"void.{row}.{col}") as file:
            found[part] = file["void"][mine]
    return found


def halve(job: BuildJob, task: Task) -> dict[str, Any]:
    """Store the known heights of a shard on all levels up to the coarsest, in files."""
    known = _known(job, area(job.pyramid.posts(0), job.pyramid.shard, task.at))
    levels = {}
    for level in range(1, _coarsest(job.pyramid) + 1):
        known = levels[f"level{level}"] = pull(known)
    job.keep(f"known.{task.row}.{task.col}", **levels)
    return {"checks": []}


def fill_coarsest(job: BuildJob, task: Task) -> dict[str, Any]:
    """Fill the coarsest level of the whole map."""
    level = _coarsest(job.pyramid)
    rows, cols = _size(job.pyramid, level)
    job.keep("filled", heights=Filling(_known(job, (slice(0, rows), slice(0, cols)), level)).filled[0])
    return {"checks": []}


def fill(job: BuildJob, task: Task) -> dict[str, Any]:
    """Fill the heights of a shard with voids."""
    pyramid = job.pyramid
    level = _coarsest(pyramid)
    with job.kept("filled") as whole:
        filled = whole["heights"][_around(pyramid, level, task.at, AROUND if level else 0)]
    while level:
        level -= 1
        known = _around(pyramid, level, task.at, 2 * AROUND)
        around = _around(pyramid, level, task.at, AROUND if level else 0)
        (y0, y1), (x0, x1) = ((s.start - k.start, s.stop - k.start - 1) for s, k in zip(around, known, strict=True))
        filled = push(_known(job, known, level), filled, (x0, y0, x1, y1))
    job.keep(f"filled.{task.row}.{task.col}", heights=filled)
    return {"checks": []}


def replace(job: BuildJob, task: Task) -> dict[str, Any]:
    """Write the filled heights of a shard; returns the hash of its heights and voids."""
    where = area(job.pyramid.posts(0), job.pyramid.shard, task.at)
    with job.kept(f"filled.{task.row}.{task.col}") as part:
        heights = np.ascontiguousarray(part["heights"])
    void = np.packbits(of_area(job, where))
    noted = job.write("heights", 0, where, heights)
    return {"sha256": hashlib.sha256(heights.tobytes() + void.tobytes()).hexdigest()} | noted


def _coarsest(pyramid: StoreSizes) -> int:
    return max(0, (pyramid.shard // SIDE).bit_length() - 1)


def _size(pyramid: StoreSizes, level: int) -> tuple[int, int]:
    """Rows and columns of a level of halved heights."""
    return -(-pyramid.rows >> level), -(-pyramid.cols >> level)


def _around(pyramid: StoreSizes, level: int, at: tuple[int, int], posts: int) -> Area:
    """The area of a shard on a level of halved heights, with `posts` more on each side, cut at the map's rim."""
    side = pyramid.shard >> level
    rows, cols = (
        slice(max(k * side - posts, 0), min((k + 1) * side + posts, n))
        for k, n in zip(at, _size(pyramid, level), strict=True)
    )
    return rows, cols


def _known(job: BuildJob, where: Area, level: int = 0) -> np.ndarray:
    """Known heights of an area of a level, NaN where void."""
    if level == 0:
        heights = job.arrays.read("heights", 0, where)
        heights[of_area(job, where)] = np.nan
        return heights
    rows, cols = where
    found = np.empty((rows.stop - rows.start, cols.stop - cols.start), np.float32)
    for (row, col), mine, part in tiles_over(where, job.pyramid.shard >> level):
        with job.kept(f"known.{row}.{col}") as file:
            found[part] = file[f"level{level}"][mine]
    return found
