"""Error records of a part of a map, bit for bit equal to the records of the whole map's tables.

A record depends on the posts of its closed node, on whether some of them are the map's last posts, and on the map's
quantisation range. So a part of the map gets one post more than its last nodes need, and the range of the whole map.
"""

import threading
from typing import NamedTuple

import numpy as np

from ..basics.steps import Steps
from ..error import ErrorTables
from ..gpu.context import create_context
from ..gpu.selftest import check_driver
from ..heightmap import Heightmap
from ..readers.raster import Spacing
from ..terrain import Terrain

APRON = 2  # extra posts of a part, to the south and the east: the far side of its last nodes, and one more
_of_thread = threading.local()


class Records(NamedTuple):
    """Error records and height ranges of the nodes of one level."""

    errors: np.ndarray  # (rows, cols) uint32: errors of the nodes as cells of a patch, the words of `layout.NODE`
    ranges: np.ndarray  # (2, rows, cols) uint16


def record_steps(
    heights: np.ndarray, spacing_m: Spacing, range_m: tuple[float, float], levels: int, void: np.ndarray | None = None
) -> Steps[list[Records]]:
    """Records of levels 1 to `levels` for all nodes over these posts; yields progress from 0 to 1.

    Nodes that extend into the apron are cut off there: ignore their records. Between two steps, this thread must not
    make another OpenGL context current.

    Parameters
    ----------
    heights
        (rows, cols) float32 metres, voids filled; the first post is a corner of all levels' nodes.
    range_m
        Lowest and highest height of the whole map.
    void
        (rows, cols) bool, the posts that are voids; None if there are no voids.
    """
    blank = _blank_tables()
    part = Heightmap(heights, spacing_m, "a part of the map")
    part.quantised_m = range_m
    if void is not None and void.any():
        part.heights = np.where(void, np.float32(np.nan), heights)
        part.voids = int(np.count_nonzero(void))
    terrain = Terrain(blank.ctx, part, blank.terrain, levels, filled=heights)
    try:
        tables = blank.beside(terrain)
        try:
            for share in tables.node_steps(levels):
                tables.ctx.finish()
                yield share
            return [_records(tables, level) for level in range(1, levels + 1)]
        finally:
            tables.release_tables()
    finally:
        terrain.release()


def release_context() -> None:
    """Release this thread's context, if it has made one."""
    if hasattr(_of_thread, "tables"):
        _of_thread.tables.ctx.release()
        del _of_thread.tables


def _records(tables: ErrorTables, level: int) -> Records:
    words = tables.read_nodes(level).view("<u4")
    return Records(words, np.moveaxis(tables.read_ranges(level)["heights"], -1, 0))


def _blank_tables() -> ErrorTables:
    """Empty tables in an OpenGL context of this thread. The tables of all parts use the shaders of these tables."""
    if not hasattr(_of_thread, "tables"):
        ctx = create_context("auto")
        check_driver(ctx)
        _of_thread.tables = ErrorTables(Terrain(ctx, Heightmap(np.zeros((3, 3), np.float32))), build=False)
    tables: ErrorTables = _of_thread.tables
    tables.ctx.__enter__()  # type: ignore[no-untyped-call]
    return tables
