"""Marks of a paged map: bits that say which posts are voids or water, and which nodes are or have holes.

    VOID    post without data; its height is filled from the rim of the voids
    WET     post in water
    HOLE    node all of whose cells are holes; a cell with a void corner is a hole
    HOLED   node with at least one hole

A node has its marks at its first post. Posts of the last row and column begin no node.
"""

import numpy as np

from ..gpu.layout import HOLE, HOLED, VOID, WET


def marks_of_cells(void: np.ndarray, water: np.ndarray | None = None) -> np.ndarray:
    """Marks of posts and of the cells between them, (rows, cols) uint8."""
    marks = np.where(void, VOID, 0).astype(np.uint8)
    if water is not None:
        marks[water] |= WET
    hole = (void[:-1, :-1] | void[:-1, 1:]) | (void[1:, :-1] | void[1:, 1:])
    marks[:-1, :-1][hole] |= HOLE | HOLED
    return marks


def coarser(marks: np.ndarray, rows: np.ndarray, cols: np.ndarray, last: tuple[int, int]) -> np.ndarray:
    """Marks of the next coarser level, from the marks of a part of a level.

    The posts of the coarser level are `rows` and `cols` of the part. `last` is the last row and column of the whole
    level, counted in the part.
    """
    found = marks[np.ix_(rows, cols)] & (VOID | WET)
    all_holes = np.full(found.shape, HOLE, np.uint8)
    parts = np.zeros(found.shape, np.uint8)
    for i, j in np.ndindex(2, 2):
        is_there = (rows + i < last[0])[:, None] & (cols + j < last[1])
        child = marks[np.ix_(np.minimum(rows + i, len(marks) - 1), np.minimum(cols + j, marks.shape[1] - 1))]
        all_holes &= np.where(is_there, child, HOLE)
        parts |= np.where(is_there, child & HOLED, 0)
    is_node = (rows < last[0])[:, None] & (cols < last[1])
    return np.where(is_node, found | (all_holes & HOLE) | parts, found).astype(np.uint8)


def known(heights: np.ndarray, marks: np.ndarray | None) -> np.ndarray:
    """Heights, but NaN at voids; `marks` are the marks of the same posts."""
    if marks is None or not (void := marks & VOID).any():
        return heights
    return np.where(void, np.float32(np.nan), heights)


def is_mixed(marks: np.ndarray) -> bool:
    """Whether any node has both holes and land."""
    return bool(((marks & (HOLE | HOLED)) == HOLED).any())
