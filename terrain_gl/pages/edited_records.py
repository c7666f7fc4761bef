"""Records of an edited store: the records on disk, widened where posts have moved, or computed anew (rebuilding.py)."""

import numpy as np

from ..basics.rect import Area, span_of
from ..gpu.packing import STEPS, pack_range
from .map import Page
from .sheet import Sheet
from .widening import Moves, Scale, widened

UNKNOWN = 0xFFFFFFFF  # no record was computed anew
# Of each node: its moves (`Moves`), its record if it was computed anew, and its range. Without such a record, the range
# is that of the new heights alone.
_EDITED = [("truth", "f4"), ("vertices", "f4"), ("errors", "u4"), ("low", "u2"), ("high", "u2")]
_UNEDITED = (0.0, 0.0, UNKNOWN, STEPS, 0)


class EditedRecords:
    """Records of all levels from 1 on.

    `tile` and `top` are those of the map. `last` is the row and column of its last post, and `scale` the quantisation
    range of the records on disk.
    """

    def __init__(self, tile: int, top: int, last: tuple[int, int], scale: Scale) -> None:
        self._last = last
        self._scale = scale
        self._sheets = [Sheet(tile, _UNEDITED, _EDITED) for _ in range(top + 1)]

    @property
    def bytes(self) -> int:
        """Memory in bytes."""
        return sum(sheet.bytes for sheet in self._sheets)

    def bytes_for(self, level: int, nodes: Area) -> int:
        """How much memory moves of these nodes would add."""
        return self._sheets[level].bytes_for(nodes)

    def move(self, level: int, nodes: Area, moved: Moves) -> None:
        """Widen the records of nodes whose posts have moved. Moves of several edits add up."""
        low, high = pack_range(moved.low, moved.high, *self._scale)
        for entries, part in self._sheets[level].views(nodes):
            entries["truth"] += moved.truth[part]
            entries["vertices"] += moved.vertices[part]
            entries["low"] = np.minimum(entries["low"], low[part])
            entries["high"] = np.maximum(entries["high"], high[part])

    def note_exact(self, level: int, area: Area, errors: np.ndarray, ranges: np.ndarray) -> Area | None:
        """Store exact records of all nodes of an area, computed from the present heights: their words, and ranges.

        Returns the nodes whose records were wide, or None if there are none.
        """
        wide = self._wide(level, area)
        if not wide.any():
            return None
        down, across = np.atleast_1d(wide.any(1)), np.atleast_1d(wide.any(0))
        rows, cols = span_of(down), span_of(across)
        exact = np.full(wide[rows, cols].shape, self._sheets[level].fill)
        exact["errors"] = errors[rows, cols]
        exact["low"], exact["high"] = ranges[:, rows, cols]
        mine = span_of(down, area[0].start), span_of(across, area[1].start)
        self._sheets[level].put(mine, exact)
        return mine

    def is_wide(self, level: int, area: Area) -> bool:
        """Whether records of an area are wide."""
        return bool(self._wide(level, area).any())

    def _wide(self, level: int, area: Area) -> np.ndarray:
        entries = self._sheets[level].get(area)
        return np.zeros((1, 1), bool) if entries is None else np.asarray(entries["truth"] > 0)

    def of(self, page: Page, level: int, area: Area, most_m: float) -> tuple[np.ndarray, np.ndarray]:
        """Records and ranges of a page's nodes with all edits; `area` is the rows and columns of these nodes.

        No error is above `most_m`.
        """
        errors = page.errors
        ranges = page.ranges
        entries = self._sheets[level].get(area)
        if entries is None:
            return errors, ranges
        is_exact = entries["errors"] != UNKNOWN
        errors = np.where(is_exact, entries["errors"], errors)
        moved, whole = (entries["truth"], entries["vertices"]), self._squares(level, area)
        errors = widened(errors, *moved, whole, level, self._scale, most_m)
        low = np.where(is_exact, entries["low"], np.minimum(ranges[0], entries["low"]))
        high = np.where(is_exact, entries["high"], np.maximum(ranges[1], entries["high"]))
        return errors, np.stack([low, high])

    def _squares(self, level: int, area: Area) -> np.ndarray:
        """Which nodes of an area lie wholly on the map."""
        places = zip(area, self._last, strict=True)
        rows, cols = ((np.arange(s.start, s.stop) + 1) << level <= last for s, last in places)
        return rows[:, None] & cols
