"""Sizes of a store: levels, their arrays, and the shards that each task writes.

Level l has every 2^l-th post, and the last one of each row and column. These posts are its lattice: post i of the
lattice is post min(i · 2^l, last) of the map. The nodes of the level are the cells of the lattice.
"""

from collections.abc import Iterator
from typing import NamedTuple

from ..basics.rect import Area, nodes_along
from ..gpu.layout import levels_over

TILE = 256  # posts a side
SHARD = 2048


class StoreSizes(NamedTuple):
    """Sizes of the arrays of a store.

    A *tile* is a chunk of an array: it is read and checked as a whole. A *shard* is the file that one task writes.
    """

    rows: int  # posts of the map
    cols: int
    tile: int = TILE  # posts along a side of a tile, a power of two
    shard: int = SHARD  # posts along a side of a shard, a power of two

    @property
    def top(self) -> int:
        """The coarsest level: the top of the map's tree, or, if finer, the level with nodes as large as a shard."""
        return min(len(levels_over(self.cols, self.rows)) - 1, self.shard.bit_length() - 1)

    @property
    def fine(self) -> int:
        """The coarsest level at which one task, over a shard of posts, writes a whole shard of nodes."""
        return min((self.shard // self.tile).bit_length() - 1, self.top)

    def posts(self, level: int) -> tuple[int, int]:
        """Rows and columns of a level's lattice."""
        rows, cols = self.nodes(level)
        return rows + 1, cols + 1

    def nodes(self, level: int) -> tuple[int, int]:
        """Rows and columns of a level's nodes."""
        return nodes_along(self.rows, level), nodes_along(self.cols, level)

    def shard_of(self, name: str, level: int) -> int:
        """Entries along a side of a shard of an array: for records of fine levels, those that one task measures."""
        return self.shard >> level if name in ("errors", "ranges") and level <= self.fine else self.shard


def areas(shape: tuple[int, int], side: int) -> Iterator[tuple[int, int]]:
    """Row and column of each square of `side` × `side` entries of an array."""
    for row in range(-(-shape[0] // side)):
        for col in range(-(-shape[1] // side)):
            yield row, col


def area(shape: tuple[int, int], side: int, at: tuple[int, int], beyond: int = 0) -> Area:
    """One square of an array, with `beyond` more entries to the south and the east, cut at the array's rim."""
    rows, cols = (slice(k * side, min((k + 1) * side + beyond, n)) for k, n in zip(at, shape, strict=True))
    return rows, cols
