"""Maps that are read page by page, and the numbers of pages.

A page is a tile of nodes of one level, with the posts at their corners (glsl/pages/terrain.glsl). Its number counts the
pages of level 0, row after row, then those of level 1, and so on.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ..basics.exceptions import TerrainError
from ..basics.limits import is_too_large
from ..basics.rect import nodes_along
from ..heightmap import Heightmap
from .marks import known

PageKey = tuple[int, int, int]  # level, row and column of a page
COARSE_POSTS = 1 << 20  # most posts of the coarse map from which a first view is chosen


class Page(NamedTuple):
    """A tile of a level, as it is read from the map. At level 0, `errors` and `ranges` are empty."""

    heights: np.ndarray  # (rows + 1, cols + 1) float32 metres at the corners of its nodes
    errors: np.ndarray  # (rows, cols) uint32: errors of the nodes as cells of a patch, the words of `layout.NODE`
    ranges: np.ndarray  # (2, rows, cols) uint16: lowest and highest height of the nodes
    marks: np.ndarray | None = None  # (rows + 1, cols + 1) uint8: of posts and nodes; None for a map without marks


class PostsOnDemand:
    """All posts of a map as an array. They are not in memory: they are computed or loaded when they are read."""

    dtype = np.dtype(np.float32)
    ndim = 2
    shape: tuple[int, int]

    @property
    def size(self) -> int:
        """Number of posts."""
        return self.shape[0] * self.shape[1]

    @property
    def nbytes(self) -> int:
        """Bytes that all posts together would take in memory."""
        return 4 * self.size

    def __getitem__(self, index: Any) -> Any:
        """Posts at (rows, columns): slices, numbers, or arrays of numbers; negative numbers are not supported."""
        rows, cols = (
            np.arange(*each.indices(n)) if isinstance(each, slice) else np.asarray(each)
            for each, n in zip(index, self.shape, strict=True)
        )
        if isinstance(index[0], slice) and isinstance(index[1], slice):
            rows = rows[:, None]
        found = self._at(*np.broadcast_arrays(rows, cols))
        return found if found.ndim else found[()]

    def _at(self, rows: np.ndarray, cols: np.ndarray) -> np.ndarray:
        """Posts at rows and columns, two arrays of one shape."""
        raise NotImplementedError

    def __mul__(self, factor: float) -> PostsOnDemand:
        return Exaggerated(self, factor)


class Exaggerated(PostsOnDemand):
    """The posts of another array, times a factor."""

    def __init__(self, posts: PostsOnDemand, factor: float) -> None:
        self.shape = posts.shape
        self._posts = posts
        self._factor = np.float32(factor)

    def __getitem__(self, index: Any) -> Any:
        return self._posts[index] * self._factor


class PagedHeights(PostsOnDemand):
    """The true heights of a paged map, NaN where void. Reading them loads the tiles that they are in."""

    def __init__(self, heightmap: PagedMap, shape: tuple[int, int]) -> None:
        self.shape = shape
        self._heightmap = heightmap

    def __getitem__(self, index: Any) -> Any:
        rows, cols = index
        if isinstance(rows, slice) and isinstance(cols, slice):  # whole rectangles are faster than single posts
            (y, end, down), (x, right, across) = (s.indices(n) for s, n in zip(index, self.shape, strict=True))
            if down > 0 and across > 0:
                return self._heightmap.part(slice(y, max(y, end)), slice(x, max(x, right)))[::down, ::across]
        return super().__getitem__(index)

    def _at(self, rows: np.ndarray, cols: np.ndarray) -> np.ndarray:
        found = np.empty(rows.shape, np.float32)
        side = self._heightmap.tile
        tiles = rows // side * self.shape[1] + cols // side
        for tile in np.unique(tiles):
            mine = tiles == tile
            row, col = rows[mine], cols[mine]
            first = row.min(), col.min()
            part = self._heightmap.part(slice(first[0], row.max() + 1), slice(first[1], col.max() + 1))
            found[mine] = part[row - first[0], col - first[1]]
        return found


class PagedMap(Heightmap):
    """A map that is read page by page. Pages and heights may be read by several threads at the same time."""

    is_store = True
    is_marked = False  # whether its pages have marks
    has_water = False  # whether some of them mark water
    sea_m: float | None = None  # height of the sea that continues beyond the map; None if the map has no sea
    tile: int  # nodes along a side of a page, a power of two
    top: int  # the coarsest level
    gpu_bytes: int = 512 << 20  # limit of the GPU memory for pages
    memory_bytes: int = 512 << 20  # limit of this process's memory for data that is read

    def page(self, key: PageKey) -> Page:
        """Read a page. If it is missing or damaged, a `TerrainError` says which page, and why."""
        raise NotImplementedError

    def lattice_heights(self, level: int, rows: slice, cols: slice) -> np.ndarray:
        """Heights of posts of a level's lattice, (rows, cols) float32 metres, voids filled.

        Raises
        ------
        TerrainError
            A tile of them is missing or damaged.
        """
        raise NotImplementedError

    def lattice_marks(self, level: int, rows: slice, cols: slice) -> np.ndarray | None:
        """Marks of posts of a level's lattice, (rows, cols) uint8; None for a map without marks."""
        return None

    def part(self, rows: slice, cols: slice, level: int = 0) -> np.ndarray:
        """The true heights of a rectangle of posts, (rows, cols) metres, NaN where void. This may wait for a disk."""
        return known(self.lattice_heights(level, rows, cols), self.lattice_marks(level, rows, cols))

    def version(self, key: PageKey) -> int:
        """The number of the last change of a page; 0 if it was never changed."""
        return 0

    @property
    def identity(self) -> str:
        """A hash of all heights; "" if it is not known."""
        return ""

    def coarse(self) -> Heightmap:
        """A coarse map for choosing a view: the finest level with at most `COARSE_POSTS` posts that can be read."""
        level = 0
        while level < self.top and (np.prod(self.posts(level)) > COARSE_POSTS or is_too_large(*self.posts(level))):
            level += 1
        while True:
            rows, cols = self.posts(level)
            try:
                heights = self.part(slice(0, rows), slice(0, cols), level)
                break
            except TerrainError:  # a coarser level serves as well
                if level == self.top:
                    raise
                level += 1
        (width, depth) = self.extent_m
        return Heightmap(heights, (width / (cols - 1), depth / (rows - 1)), self.name)

    def posts(self, level: int) -> tuple[int, int]:
        """Rows and columns of a level's lattice."""
        rows, cols = self.nodes(level)
        return rows + 1, cols + 1

    def nodes(self, level: int) -> tuple[int, int]:
        """Rows and columns of a level's nodes."""
        return nodes_along(self.rows, level), nodes_along(self.cols, level)

    def pages(self, level: int) -> tuple[int, int]:
        """Rows and columns of a level's pages."""
        rows, cols = self.nodes(level)
        return -(-rows // self.tile), -(-cols // self.tile)

    @cached_property
    def numbering(self) -> Numbering:
        """The numbers of its pages."""
        return Numbering(self)


class Boxes(NamedTuple):
    """Closed boxes of posts, one row for each box."""

    low: np.ndarray  # (n, 2) column and row
    end: np.ndarray

    def some(self, which: np.ndarray) -> Boxes:
        """The selected boxes."""
        return Boxes(self.low[which], self.end[which])


class Numbering:
    """Numbers of the pages of a map."""

    def __init__(self, heightmap: PagedMap) -> None:
        # (levels, 2): rows and columns of pages of each level
        self.size = np.array([heightmap.pages(level) for level in range(heightmap.top + 1)], np.int64)
        # (levels + 1): number of the first page of each level, then the number of all pages
        self.first = np.concatenate([[0], np.cumsum(self.size.prod(1))])
        self._log2 = heightmap.tile.bit_length() - 1

    @property
    def total(self) -> int:
        """Number of pages of all levels."""
        return int(self.first[-1])

    def number(self, key: PageKey) -> int:
        """The number of a page."""
        level, row, col = key
        return int(self.first[level] + row * self.size[level, 1] + col)

    def key(self, number: int) -> PageKey:
        """The page with a number: the inverse of `number`."""
        level = int(np.searchsorted(self.first, number, "right")) - 1
        row, col = divmod(int(number - self.first[level]), int(self.size[level, 1]))
        return level, row, col

    def above(self, numbers: np.ndarray) -> np.ndarray:
        """The pages of the next coarser level that cover pages, by their numbers; none for pages of the coarsest."""
        numbers = numbers[numbers < self.first[-2]]
        level = np.searchsorted(self.first, numbers, "right") - 1
        row, col = np.divmod(numbers - self.first[level], self.size[level, 1])
        return np.unique(self.first[level + 1] + row // 2 * self.size[level + 1, 1] + col // 2)

    def over(self, boxes: Boxes, level: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """All pages over each box at its level, as pairs: the index of the box, the number of the page."""
        first, last = self._corners(boxes, level)
        (cols, rows) = (last - first + 1).T
        count = rows * cols
        box = np.repeat(np.arange(len(count)), count)
        within = np.arange(len(box)) - np.repeat(np.cumsum(count) - count, count)
        row, col = first[box, 1] + within // cols[box], first[box, 0] + within % cols[box]
        return box, self.first[level[box]] + row * self.size[level[box], 1] + col

    def count(self, boxes: Boxes, level: np.ndarray) -> np.ndarray:
        """How many pages are over each box at its level."""
        first, last = self._corners(boxes, level)
        return (last - first + 1).prod(1)

    def _corners(self, boxes: Boxes, level: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Column and row of the first and of the last page over each box."""
        shift = (level + self._log2)[:, None]
        most = self.size[level][:, ::-1] - 1
        first, last = (np.minimum(np.maximum(at, 0) >> shift, most) for at in boxes)
        return first, last


def called(key: PageKey) -> str:
    """The name of a page in messages."""
    level, row, col = key
    return f"level {level}, row {row}, column {col}"


def above(key: PageKey) -> PageKey:
    """The page of the next coarser level that covers a page."""
    level, row, col = key
    return level + 1, row // 2, col // 2
