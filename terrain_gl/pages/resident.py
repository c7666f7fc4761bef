"""The heights of the loaded pages, as they are drawn at each post. Nothing here waits for a disk.

Numpy twin of `height_m` in glsl/pages/terrain.glsl.
"""

from __future__ import annotations

from copy import copy

import numpy as np

from ..gpu.layout import HOLED
from .map import PagedMap, PostsOnDemand
from .marks import known


class ResidentHeights(PostsOnDemand):
    """All posts of a map, computed from the loaded pages.

    `finest` has, for each page of level 0, the finest loaded page over it, as slot + (level << 24). `copies` are the
    heights in each slot, (slots, side + 1, side + 1) float32 metres. `marks` are the marks of the same posts, uint8:
    only `known` has them, and makes their voids NaN.
    """

    marks: np.ndarray | None = None

    def __init__(self, heightmap: PagedMap, finest: np.ndarray, slots: int) -> None:
        self.shape = (heightmap.rows, heightmap.cols)
        self._finest = finest
        self._log2 = heightmap.tile.bit_length() - 1
        self.copies = np.empty((slots, heightmap.tile + 1, heightmap.tile + 1), np.float32)

    def copy(self) -> ResidentHeights:
        """A copy of the present heights, which does not change when other pages are loaded."""
        other = copy(self)
        slots, place = np.unique(self._finest & 0xFFFFFF, return_inverse=True)
        other._finest = (self._finest & 0xFF000000) | place.reshape(self._finest.shape).astype(np.uint32)
        other.copies = self.copies[slots]
        other.marks = None if self.marks is None else self.marks[slots]
        return other

    def known(self) -> ResidentHeights:
        """The same heights, but NaN where void. Code that writes `copies` must also write the `marks` of this copy."""
        other = copy(self)
        other.marks = np.zeros(self.copies.shape, np.uint8)
        return other

    def may_be_holes(self, rows: np.ndarray, cols: np.ndarray) -> np.ndarray:
        """Whether cells lie in nodes with holes, of the finest loaded pages. Only `known` can tell."""
        assert self.marks is not None
        cells = np.broadcast_arrays(rows, cols)
        fine, level, slot = self._page_over(*cells)
        y, x = (cell - ((f >> level) << self._log2 + level) >> level for cell, f in zip(cells, fine, strict=True))
        return (self.marks[slot, y, x] & HOLED) > 0

    def _page_over(self, rows: np.ndarray, cols: np.ndarray) -> tuple[list[np.ndarray], np.ndarray, np.ndarray]:
        """Of the finest loaded pages over posts: rows and columns of pages of level 0; levels and slots."""
        posts = rows, cols
        fine = [np.minimum(p >> self._log2, n - 1) for p, n in zip(posts, self._finest.shape, strict=True)]
        word = self._finest[fine[0], fine[1]]
        return fine, (word >> 24).astype(np.int64), (word & 0xFFFFFF).astype(np.int64)

    def _at(self, rows: np.ndarray, cols: np.ndarray) -> np.ndarray:
        posts = rows, cols
        fine, level, slot = self._page_over(rows, cols)
        places = [
            _between(p, (f >> level) << self._log2 + level, level, n - 1)
            for p, f, n in zip(posts, fine, self.shape, strict=True)
        ]
        (y, down, v), (x, right, u) = places
        north = _mix(self._copied(slot, y, x), self._copied(slot, y, right), u)
        south = _mix(self._copied(slot, down, x), self._copied(slot, down, right), u)
        return _mix(north, south, v)

    def _copied(self, *at: np.ndarray) -> np.ndarray:
        return known(self.copies[at], None if self.marks is None else self.marks[at])


def _between(
    post: np.ndarray, first: np.ndarray, level: np.ndarray, last: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Along one axis, for each post: the lattice places before and after it, and its fraction of the way between."""
    at = (post - first) >> level
    low = first + (at << level)
    high = np.minimum(low + (1 << level), last)
    is_high = (low < high) & (post == high)  # the map's last posts
    share = np.where(is_high, 0, post - low) / np.maximum(high - low, 1)
    at = at + is_high
    return at, at + (share > 0), share.astype(np.float32)


def _mix(a: np.ndarray, b: np.ndarray, t: np.ndarray) -> np.ndarray:
    return (a * (1 - t) + b * t).astype(np.float32)
