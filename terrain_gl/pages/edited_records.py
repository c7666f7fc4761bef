"""Records of an edited store: the records on disk, widened where posts have moved, or computed anew.

moved, each level    how far posts of each node have moved: these moves widen its record (`pages.widening`)
errors, ranges       records that were computed anew (rebuilding.py)
"""

from __future__ import annotations

import numpy as np

from ..basics.rect import span_of
from ..gpu.packing import pack_16, unpack_16
from .map import Page
from .sheet import Area, Sheet
from .widening import Moves, Scale, rescaled, rescaled_ranges, widened, widened_ranges

UNKNOWN = 0xFFFFFFFF  # no record


class EditedRecords:
    """Records of all levels from 1 on.

    Parameters
    ----------
    tile, top
        Nodes a side of a page; the coarsest level.
    last
        Row and column of the map's last post.
    scale
        The quantisation range of the records on disk.
    """

    def __init__(self, tile: int, top: int, last: tuple[int, int], scale: Scale) -> None:
        self._last = last
        self._base_scale = scale
        self._scale = scale
        levels = range(top + 1)
        fills = Moves(*(np.array(fill) for fill in (0.0, 0.0, np.inf, -np.inf)))
        self._moved = [[Sheet(tile, float(fill)) for fill in fills] for _ in levels]  # as `Moves`
        self._errors = [Sheet(tile, UNKNOWN, "u4") for _ in levels]
        self._ranges = [Sheet(tile, 0, "u4") for _ in levels]

    def copy(self) -> EditedRecords:
        """A copy that changes on its own."""
        own = EditedRecords(self._ranges[0].side, len(self._ranges) - 1, self._last, self._base_scale)
        own._scale = self._scale
        own._moved = [[sheet.copy() for sheet in sheets] for sheets in self._moved]
        own._errors = [sheet.copy() for sheet in self._errors]
        own._ranges = [sheet.copy() for sheet in self._ranges]
        return own

    @property
    def bytes(self) -> int:
        """Memory in bytes."""
        return sum(sheet.bytes for sheets in (*self._moved, self._errors, self._ranges) for sheet in sheets)

    def move(self, level: int, nodes: Area, moved: Moves) -> None:
        """Widen the records of nodes whose posts have moved. Moves of several edits add up."""
        for sheet, values, by in zip(self._moved[level], moved, (np.add, np.add, np.minimum, np.maximum), strict=True):
            sheet.put(nodes, values, by)

    def rescale(self, scale: Scale) -> None:
        """Convert everything to another quantisation range."""
        for sheet in self._errors:
            for at, words in sheet.tiles.items():
                sheet.tiles[at] = np.where(words == UNKNOWN, words, rescaled(words, self._scale, scale))
        for ranges in self._ranges:
            for at, words in ranges.tiles.items():
                ranges.tiles[at] = pack_16(*rescaled_ranges(unpack_16(words), self._scale, scale))
        self._scale = scale

    def note_exact(self, level: int, area: Area, errors: np.ndarray, ranges: np.ndarray) -> Area | None:
        """Store exact records of all nodes of an area, computed from the present heights.

        Parameters
        ----------
        errors
            (rows, cols) uint32: words of the records.
        ranges
            (2, rows, cols) uint16.

        Returns
        -------
        Area, optional
            The nodes whose records were wide; None if there are none.
        """
        truth = self._moved[level][0].get(area)
        if truth is None or not np.any(truth > 0):
            return None
        wide = np.greater(truth, 0)
        rows, cols = (span_of(np.asarray(wide.any(axis))) for axis in (1, 0))
        mine = _shifted(area[0], rows), _shifted(area[1], cols)
        self._errors[level].put(mine, errors[rows, cols])
        self._ranges[level].put(mine, pack_16(*ranges[:, rows, cols]))
        for sheet in self._moved[level]:
            sheet.clear(mine)
        return mine

    def is_wide(self, level: int, area: Area) -> bool:
        """Whether records of an area are wide."""
        truth = self._moved[level][0].get(area)
        return truth is not None and bool(np.any(truth > 0))

    def of(self, page: Page, level: int, area: Area) -> tuple[np.ndarray, np.ndarray]:
        """Records and ranges of a page's nodes with all edits; `area` is the rows and columns of these nodes."""
        errors = page.errors
        ranges = page.ranges
        if self._scale != self._base_scale:
            errors = rescaled(errors, self._base_scale, self._scale)
            ranges = rescaled_ranges(ranges, self._base_scale, self._scale)
        exact = self._errors[level].get(area)
        packed = self._ranges[level].get(area)
        if exact is not None and packed is not None:
            errors = np.where(exact == UNKNOWN, errors, exact)
            ranges = np.where(exact == UNKNOWN, ranges, unpack_16(packed))
        found = [values for sheet in self._moved[level] if (values := sheet.get(area)) is not None]
        if len(found) == len(Moves._fields):
            moved = Moves(*found)
            errors = widened(errors, moved, self._squares(level, area), level, self._scale)
            ranges = widened_ranges(ranges, moved, self._scale)
        return errors, ranges

    def _squares(self, level: int, area: Area) -> np.ndarray:
        """Which nodes of an area lie wholly on the map."""
        places = zip(area, self._last, strict=True)
        rows, cols = ((np.arange(s.start, s.stop) + 1) << level <= last for s, last in places)
        return rows[:, None] & cols


def _shifted(whole: slice, part: slice) -> slice:
    return slice(whole.start + part.start, whole.start + part.stop)
