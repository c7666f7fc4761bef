"""Sheets: large arrays of which only some tiles are in memory. All other entries have one value."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from ..basics.rect import Area, tiles_over


class Sheet:
    """A 2-D array in tiles of `side` entries. A tile takes memory only when something is written in it.

    `tiles` are the tiles in memory, by row and column. Entries that were never written have the value `fill`.
    """

    def __init__(self, side: int, fill: ArrayLike, dtype: DTypeLike = "f4") -> None:
        self.side = side
        self.fill = np.array(fill, dtype)
        self.tiles: dict[tuple[int, int], np.ndarray] = {}

    @property
    def bytes(self) -> int:
        """Memory of all tiles."""
        return len(self.tiles) * self.side**2 * self.fill.itemsize

    def bytes_for(self, area: Area) -> int:
        """How much memory a write to an area would add."""
        new = sum(at not in self.tiles for at, _, _ in tiles_over(area, self.side))
        return new * self.side**2 * self.fill.itemsize

    def get(self, area: Area) -> np.ndarray | None:
        """The entries of an area; None if nothing was ever written there."""
        found = None
        for at, within, part in tiles_over(area, self.side):
            tile = self.tiles.get(at)  # another thread may free it at any moment
            if tile is not None:
                if found is None:
                    found = np.full([s.stop - s.start for s in area], self.fill)
                found[part] = tile[within]
        return found

    def put(self, area: Area, values: np.ndarray) -> None:
        """Write the entries of an area."""
        for entries, part in self.views(area):
            entries[...] = values[part]

    def views(self, area: Area) -> Iterator[tuple[np.ndarray, Area]]:
        """Entries of an area to write in place, one tile after the other, and their place in the area."""
        for at, within, part in tiles_over(area, self.side):
            if at not in self.tiles:
                self.tiles[at] = np.full((self.side, self.side), self.fill)
            yield self.tiles[at][within], part

    def forget_empty(self, area: Area) -> None:
        """Free those tiles of an area in which all entries have the fill value."""
        for at, _, _ in tiles_over(area, self.side):
            if at in self.tiles and np.array_equal(self.tiles[at], np.full_like(self.tiles[at], self.fill), True):
                del self.tiles[at]
