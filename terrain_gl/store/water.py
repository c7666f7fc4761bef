"""Find water in the heights of a source. The result equals that for a map in memory (`terrain.water`), post for post.

note    lowest and highest height of a shard's part of each tile
find    the tiles of the whole map that are water
at      the posts of an area that are in water
"""

from typing import Any

import numpy as np

from ..basics.rect import Area
from ..terrain import sea_of
from ..terrain.water import posts_at, tile_side, water_tiles
from .job import BuildJob, Task
from .pyramid import StoreSizes, area, areas


def note(job: BuildJob, task: Task, heights: np.ndarray) -> None:
    """Store the lowest and highest height of each tile in a shard of heights, NaN where void."""
    pyramid = job.pyramid
    where = area(pyramid.posts(0), pyramid.shard, task.at)
    ends: dict[str, np.ndarray] = {}
    for name, of in (("low", np.minimum), ("high", np.maximum)):
        found = heights
        for axis in (0, 1):
            found = of.reduceat(found, _starts(pyramid, where[axis]), axis)
        ends[name] = found
    job.keep(f"tiles.{task.row}.{task.col}", **ends)


def find(job: BuildJob, task: Task) -> dict[str, Any]:
    """Find the tiles that are water, and store them in a file."""
    pyramid = job.pyramid
    side = _side(pyramid)
    shape = tuple(-(-n // side) for n in pyramid.posts(0))  # with tiles that are cut by the rim
    low, high = np.full(shape, np.inf, np.float32), np.full(shape, -np.inf, np.float32)
    for row, col in areas(pyramid.posts(0), pyramid.shard):
        rows, cols = row * pyramid.shard // side, col * pyramid.shard // side
        with job.kept(f"tiles.{row}.{col}") as part:
            mine = np.s_[rows : rows + part["low"].shape[0], cols : cols + part["low"].shape[1]]
            low[mine] = np.minimum(low[mine], part["low"])
            high[mine] = np.maximum(high[mine], part["high"])
    whole = np.s_[: pyramid.rows // side, : pyramid.cols // side]
    found = None if min(pyramid.posts(0)) < 2 * side else water_tiles(low[whole], high[whole])
    if found is not None:
        job.keep("water", heights=found)
    return {"has_water": found is not None, "checks": []}


def at(job: BuildJob, where: Area, heights: np.ndarray) -> np.ndarray | None:
    """Posts in water of an area, (rows, cols) bool; None without water. `heights` are NaN where void."""
    if not job.has_water:
        return None
    with job.kept("water") as water:
        return posts_at(water["heights"], heights, _side(job.pyramid), (where[0].start, where[1].start))


def on_rim(pyramid: StoreSizes, where: Area, heights: np.ndarray) -> list[tuple[float, int]]:
    """Heights of water at the map's rim in an area, each with its number of posts. `heights` are NaN where dry."""
    rows, cols = (np.arange(s.start, s.stop) for s in where)
    rim = np.isin(rows, (0, pyramid.rows - 1))[:, None] | np.isin(cols, (0, pyramid.cols - 1))
    levels, counts = np.unique(heights[rim & np.isfinite(heights)], return_counts=True)
    return list(zip(levels.tolist(), counts.tolist(), strict=True))


def sea(pyramid: StoreSizes, found: list[tuple[float, int]]) -> float | None:
    """The height of the sea, from the results of `on_rim`; None if there is no sea."""
    heights = np.repeat([level for level, _ in found], [count for _, count in found])
    return sea_of(heights, 2 * pyramid.cols + 2 * (pyramid.rows - 2))


def _side(pyramid: StoreSizes) -> int:
    return tile_side((pyramid.rows, pyramid.cols))


def _starts(pyramid: StoreSizes, posts: slice) -> np.ndarray:
    """Where tiles begin among posts along an axis. The first tile may begin before the first post."""
    side = _side(pyramid)
    inside = np.arange(-(-posts.start // side) * side, posts.stop, side) - posts.start
    return np.unique(np.concatenate([[0], inside]))
