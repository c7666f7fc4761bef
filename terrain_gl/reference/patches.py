"""lod, continued: quads that together fill a square become one patch.

A square of 2^s × 2^s quads of one level, s from 1 to 5, becomes a patch of T = 2^s segments a side.
"""

import numpy as np

from .quadtree import Leaves

SIZES = 6  # a patch of quads has 2^0 to 2^5 segments a side


def blocks(nodes: np.ndarray, n: int) -> np.ndarray:
    """Cut an array of nodes into blocks of n × n, (rows, cols, n²); incomplete blocks at the rims are dropped."""
    rows, cols = (size // n for size in nodes.shape)
    parts = nodes[: rows * n, : cols * n].reshape(rows, n, cols, n)
    return parts.transpose(0, 2, 1, 3).reshape(rows, cols, n * n)


def join(selection: Leaves) -> list[list[np.ndarray]]:
    """Patches of quads: for each level and each s, which squares of 2^s × 2^s quads are one patch, (rows, cols)."""
    found = []
    cells = selection.splits[0].shape
    for level, (leaves, fans) in enumerate(zip(selection.leaves, selection.fans, strict=True)):
        sizes = [leaves & ~fans]
        for s in range(1, min(SIZES, len(selection.leaves) - level)):
            joined = blocks(sizes[-1], 2).all(-1)
            joined &= _on_map(joined.shape, level + s, cells)
            taken = joined.repeat(2, 0).repeat(2, 1)
            sizes[-1][: taken.shape[0], : taken.shape[1]] &= ~taken
            sizes.append(joined)
        found.append(sizes)
    return found


def _on_map(shape: tuple[int, ...], level: int, cells: tuple[int, ...]) -> np.ndarray:
    """Which nodes of a level lie completely on the map."""
    y, x = (((np.arange(n) + 1) << level) <= size for n, size in zip(shape, cells, strict=True))
    return np.logical_and.outer(y, x)
