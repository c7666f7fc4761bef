"""Rectangles of posts: what an edit changed, and what must be computed again; the nodes of a level over posts."""

from __future__ import annotations

import numpy as np

Rect = tuple[int, int, int, int]  # first column and row, last column and row: all four belong to it


def hull(a: Rect, b: Rect) -> Rect:
    """The smallest rectangle that holds two."""
    return min(a[0], b[0]), min(a[1], b[1]), max(a[2], b[2]), max(a[3], b[3])


def nodes_along(posts: int, level: int) -> int:
    """Nodes of a level along an axis with `posts` posts. A node is 2^level cells wide; the last may pass the map."""
    return -(-(posts - 1) >> level)


def span_of(flags: np.ndarray, first: int = 0) -> slice:
    """Slice from the first to the last flag that is set, shifted by `first`."""
    where = np.flatnonzero(flags)
    return slice(first + int(where[0]), first + int(where[-1]) + 1)
