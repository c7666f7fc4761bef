"""Sheets: large arrays of which only some tiles are in memory. All other entries have one value."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

Area = tuple[slice, slice]  # rows and columns
Combine = Callable[[np.ndarray, np.ndarray], np.ndarray]  # of old and new entries


class Sheet:
    """A 2-D array in tiles. A tile takes memory only when something is written in it.

    Parameters
    ----------
    side
        Entries along a side of a tile.
    fill
        The value of all entries that were never written.

    Attributes
    ----------
    tiles
        The tiles in memory, by row and column.
    """

    def __init__(self, side: int, fill: float, dtype: str = "f4") -> None:
        self.side = side
        self.fill = fill
        self.dtype = np.dtype(dtype)
        self.tiles: dict[tuple[int, int], np.ndarray] = {}

    @property
    def bytes(self) -> int:
        """Memory of all tiles."""
        return len(self.tiles) * self.side**2 * self.dtype.itemsize

    def copy(self) -> Sheet:
        """A copy that changes on its own."""
        other = Sheet(self.side, self.fill, self.dtype.str)
        other.tiles = {at: tile.copy() for at, tile in self.tiles.items()}
        return other

    def get(self, area: Area) -> np.ndarray | None:
        """The entries of an area; None if nothing was ever written there."""
        found = None
        for at, within, part in self._parts(area):
            if at in self.tiles:
                if found is None:
                    found = np.full([s.stop - s.start for s in area], self.fill, self.dtype)
                found[part] = self.tiles[at][within]
        return found

    def put(self, area: Area, values: np.ndarray, by: Combine | None = None) -> None:
        """Write the entries of an area. With `by`, write `by(old, new)` instead."""
        for at, within, part in self._parts(area):
            if at not in self.tiles:
                self.tiles[at] = np.full((self.side, self.side), self.fill, self.dtype)
            tile = self.tiles[at]
            tile[within] = by(tile[within], values[part]) if by else values[part]

    def clear(self, area: Area) -> None:
        """Reset the entries of an area to the fill value, and free tiles that then have no other value."""
        for at, within, _ in self._parts(area):
            if at in self.tiles:
                self.tiles[at][within] = self.fill
        self.forget_empty(area)

    def forget_empty(self, area: Area) -> None:
        """Free those tiles of an area in which all entries have the fill value."""
        for at, _, _ in self._parts(area):
            if at in self.tiles and np.array_equal(self.tiles[at], np.full_like(self.tiles[at], self.fill), True):
                del self.tiles[at]

    def _parts(self, area: Area) -> Iterator[tuple[tuple[int, int], Area, Area]]:
        """For each tile that meets an area: its row and column, and their common part, in the tile and in the area."""
        rows, cols = (list(_cuts(s, self.side)) for s in area)
        for row, down, y in rows:
            for col, across, x in cols:
                yield (row, col), (down, across), (y, x)


def _cuts(part: slice, side: int) -> Iterator[tuple[int, slice, slice]]:
    for k in range(part.start // side, -(-part.stop // side)):
        first, end = max(part.start, k * side), min(part.stop, (k + 1) * side)
        yield k, slice(first - k * side, end - k * side), slice(first - part.start, end - part.start)
