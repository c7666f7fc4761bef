"""Error records of a part of a map, bit for bit equal to the records of the whole map's tables.

A record depends on the posts of its closed node, on whether some of them are the map's last posts, and on the map's
quantisation range. So a part of the map gets one post more than its last nodes need, and the range of the whole map.
"""

import threading
from typing import Any, NamedTuple

import numpy as np

from ..basics.steps import Steps
from ..error import ErrorTables
from ..gpu.context import create_context
from ..gpu.current import kept
from ..gpu.selftest import check_driver
from ..gpu.session import Session
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

    Nodes that extend into the apron are cut off there: ignore their records. Each step has an OpenGL context of this
    thread; between two steps, the context that was current before is so again.

    Parameters
    ----------
    heights
        (rows, cols) float32 metres, voids filled; the first post is a corner of all levels' nodes.
    range_m
        `quantised_m` of the whole map, for the units of its tables.
    void
        (rows, cols) bool, the posts that are voids; None if there are no voids.
    """
    session, blank = _blank_tables()
    steps: Any = _record_steps(blank, heights, spacing_m, range_m, levels, void)
    return (yield from session.run(steps))


def _record_steps(
    blank: ErrorTables,
    heights: np.ndarray,
    spacing_m: Spacing,
    range_m: tuple[float, float],
    levels: int,
    void: np.ndarray | None,
) -> Steps[list[Records]]:
    part = Heightmap(heights, spacing_m, "a part of the map")
    part.quantised_m = range_m
    if void is not None and void.any():
        part.heights = np.where(void, np.float32(np.nan), heights)
        part.voids = int(np.count_nonzero(void))
    terrain = Terrain(blank.ctx, part, blank.terrain, levels, filled=heights)
    try:
        tables = blank.empty_for(terrain)
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
    if hasattr(_of_thread, "session"):
        _of_thread.session.release()
        del _of_thread.session, _of_thread.tables


def _records(tables: ErrorTables, level: int) -> Records:
    words = tables.read_nodes(level).view("<u4")
    return Records(words, np.moveaxis(tables.read_ranges(level)["heights"], -1, 0))


def _blank_tables() -> tuple[Session, ErrorTables]:
    """Empty tables in an OpenGL context of this thread. The tables of all parts use the shaders of these tables."""
    if not hasattr(_of_thread, "session"):
        with kept():  # a new context is current at once
            session = Session(create_context("auto"), owned=True)
        with session:
            check_driver(session.ctx)
            flat = Heightmap(np.zeros((3, 3), np.float32))
            _of_thread.tables = ErrorTables(Terrain(session.ctx, flat), build=False)
        _of_thread.session = session
    return _of_thread.session, _of_thread.tables
