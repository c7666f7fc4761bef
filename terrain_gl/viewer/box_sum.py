"""A box of the summed-area table of heights: the four fetches, and the sum and mean that they give."""

from dataclasses import dataclass, replace

import numpy as np

from ..basics.words import metres
from ..light.ground import SumsTable
from ..renderer import Renderer
from ..terrain import quantisation_range


@dataclass(frozen=True)
class BoxSum:
    """A box of posts.

    Attributes
    ----------
    table
        The table that holds it.
    box
        First column, first row, and the column and row after the last, in the table.
    corners
        A, B, C and D: the table at north-west, north-east, south-west and south-east, modulo 2³².
    mean_m
        Mean height of the posts, in metres.
    """

    table: SumsTable
    box: tuple[int, int, int, int]
    corners: tuple[int, int, int, int]
    mean_m: float

    @property
    def posts(self) -> int:
        """Number of posts in the box."""
        return (self.box[2] - self.box[0]) * (self.box[3] - self.box[1])

    @property
    def on_map(self) -> tuple[tuple[int, int], tuple[int, int]]:
        """The box as posts of the map: its first column and row; columns and rows from its first to its last post."""
        x0, y0, x1, y1 = self.box
        (col, row), level = self.table.corner, self.table.level
        return (col + (x0 << level), row + (y0 << level)), ((x1 - x0 - 1) << level, (y1 - y0 - 1) << level)

    @property
    def sum(self) -> int:
        """(D − C) − (B − A) modulo 2³²: exact, although each corner may have wrapped."""
        a, b, c, d = self.corners
        return ((d - c) - (b - a)) % 2**32

    def lines(self) -> list[str]:
        """The numbers as text."""
        a, b, c, d = self.corners
        return [
            f"A  {a:,}      B  {b:,}      north",
            f"C  {c:,}      D  {d:,}      south",
            f"(D - C) - (B - A) = {self.sum:,} steps; the height range has 65,535 steps",
            f"{self.posts:,} posts, mean height {metres(self.mean_m)}",
            "A box of any size takes four fetches: green corners add, red corners subtract.",
            "Sums wrap at 2^32, hence the bands. Differences stay exact.",
        ]


def box_around(renderer: Renderer, col: int, row: int, side: int) -> BoxSum:
    """Look up the box around a post, at most `side` entries of the table a side, in the GPU's table."""
    table = renderer.picture.sums.table_over(col, row)
    cols, rows = table.size
    col, row = ((at - corner) >> table.level for at, corner in zip((col, row), table.corner, strict=True))
    x0, y0 = max(0, min(col - side // 2, cols - 1)), max(0, min(row - side // 2, rows - 1))
    x1, y1 = min(x0 + side, cols), min(y0 + side, rows)

    def fetch(x: int, y: int) -> int:
        if x == 0 or y == 0:
            return 0
        word = table.first + (y - 1) * table.width + x - 1
        return int.from_bytes(table.buffer.read(4, offset=4 * word), "little")

    corners = fetch(x0, y0), fetch(x1, y0), fetch(x0, y1), fetch(x1, y1)
    found = BoxSum(table, (x0, y0, x1, y1), corners, 0.0)
    _, low_m, span_m = quantisation_range(*renderer.heightmap.quantised_m)
    return replace(found, mean_m=low_m + found.sum / found.posts * span_m / 65535)


def box_under(renderer: Renderer, place: np.ndarray, side: int) -> BoxSum:
    """Read the box around a place of the land, in world metres."""
    heightmap = renderer.heightmap
    east, north = heightmap.spacing_m
    col, row = round(place[0] / east), round(heightmap.rows - 1 - place[1] / north)
    return box_around(renderer, int(col), int(row), side)
