"""Sizes of a store: levels, their arrays, and the shards that each task writes.

Level l has every 2^l-th post, and the last one of each row and column: post i of the lattice is post
min(i · 2^l, last) of the map. Its nodes are the cells between these posts.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from ..gpu.layout import quadtree

TILE, SHARD = 256, 2048  # posts a side
Area = tuple[slice, slice]  # rows and columns


class Pyramid(NamedTuple):
    """Sizes of the arrays of a store.

    Attributes
    ----------
    rows, cols
        Posts of the map.
    tile
        Posts a side of a tile: the chunk of an array, which is read, checked and drawn as a whole. A power of two.
    shard
        Posts a side of a shard: the file that one task writes. A power of two.
    """

    rows: int
    cols: int
    tile: int = TILE
    shard: int = SHARD

    @property
    def top(self) -> int:
        """The coarsest level: of the whole map's tree, or that whose nodes are as large as a shard."""
        return min(len(quadtree(self.cols, self.rows)) - 1, self.shard.bit_length() - 1)

    @property
    def fine(self) -> int:
        """The last level of which a task over one shard of posts writes a whole shard of nodes."""
        return min((self.shard // self.tile).bit_length() - 1, self.top)

    def posts(self, level: int) -> tuple[int, int]:
        """Rows and columns of a level's lattice."""
        return -(-(self.rows - 1) >> level) + 1, -(-(self.cols - 1) >> level) + 1

    def nodes(self, level: int) -> tuple[int, int]:
        """Rows and columns of a level's nodes."""
        return -(-(self.rows - 1) >> level), -(-(self.cols - 1) >> level)

    def node_shard(self, level: int) -> int:
        """Nodes a side of a shard of error records."""
        return self.shard >> level if level <= self.fine else self.shard


def areas(shape: tuple[int, int], side: int) -> Iterator[tuple[int, int]]:
    """Row and column of each square of an array."""
    for row in range(-(-shape[0] // side)):
        for col in range(-(-shape[1] // side)):
            yield row, col


def area(shape: tuple[int, int], side: int, at: tuple[int, int], beyond: int = 0) -> Area:
    """One square of an array, `beyond` entries more at its far sides, cut at the array's rim."""
    rows, cols = (slice(k * side, min((k + 1) * side + beyond, n)) for k, n in zip(at, shape, strict=True))
    return rows, cols
