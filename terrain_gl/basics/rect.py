"""Rectangles of posts: the posts that an edit changed or that must be computed again, and the nodes over them."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

Rect = tuple[int, int, int, int]  # first column and row, last column and row: all four belong to it
Area = tuple[slice, slice]  # rows and columns


def hull(a: Rect, b: Rect) -> Rect:
    """The smallest rectangle that contains both."""
    return min(a[0], b[0]), min(a[1], b[1]), max(a[2], b[2]), max(a[3], b[3])


def slices_hull(a: slice, b: slice) -> slice:
    """The smallest slice that contains both."""
    return slice(min(a.start, b.start), max(a.stop, b.stop))


def within(part: slice, whole: slice) -> slice:
    """The slice `part`, counted from the beginning of the slice `whole`."""
    return slice(part.start - whole.start, part.stop - whole.start)


class Edit(NamedTuple):
    """New heights of a rectangle of posts.

    Attributes
    ----------
    x, y
        Column and row of the first post.
    heights
        (rows, cols) float32 metres; NaN for voids, or in a store for posts without an edit.
    """

    x: int
    y: int
    heights: np.ndarray

    @property
    def rows(self) -> slice:
        """Rows of posts."""
        return slice(self.y, self.y + self.heights.shape[0])

    @property
    def cols(self) -> slice:
        """Columns of posts."""
        return slice(self.x, self.x + self.heights.shape[1])

    def part(self, rows: slice, cols: slice) -> np.ndarray:
        """The heights of a rectangle inside the edit. They are a view, so changes go into the edit."""
        return self.heights[within(rows, self.rows), within(cols, self.cols)]


def nodes_along(posts: int, level: int) -> int:
    """Number of nodes along an axis of `posts` posts. A node is 2^level cells wide; the last may end beyond the map."""
    return -(-(posts - 1) >> level)


def span_of(flags: np.ndarray, first: int = 0) -> slice:
    """Slice from the first to the last flag that is set, shifted by `first`."""
    where = np.flatnonzero(flags)
    return slice(first + int(where[0]), first + int(where[-1]) + 1)


def tiles_over(area: Area, side: int) -> Iterator[tuple[tuple[int, int], Area, Area]]:
    """The tiles of `side` × `side` entries that an area meets.

    Of each tile: its row and column; the common part with the area, counted in the tile; the same, counted in the area.
    """
    rows, cols = (list(_tiles_along(part, side)) for part in area)
    for row, down, y in rows:
        for col, across, x in cols:
            yield (row, col), (down, across), (y, x)


def _tiles_along(part: slice, side: int) -> Iterator[tuple[int, slice, slice]]:
    for k in range(part.start // side, -(-part.stop // side)):
        common = slice(max(part.start, k * side), min(part.stop, (k + 1) * side))
        yield k, slice(common.start - k * side, common.stop - k * side), within(common, part)
