"""A box of the summed-area table of heights: the four fetches, and the sum and mean that they give."""

import math
from dataclasses import dataclass

import numpy as np

from ..basics.words import metres
from ..light.ground import SumsTable
from ..renderer import Renderer
from ..terrain import quantisation_range


@dataclass(frozen=True)
class BoxSum:
    """A box of posts."""

    table: SumsTable  # the table that holds it
    box: tuple[int, int, int, int]  # first column, first row, and the column and row after the last, in the table
    corners: tuple[int, int, int, int]  # table at north-west, north-east, south-west and south-east, modulo 2³²
    range_m: tuple[float, float]  # the quantisation range: its lowest height, and its width in metres
    steps_below: int = 0  # how far edits went below it

    @property
    def posts(self) -> int:
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

    @property
    def mean_m(self) -> float:
        low_m, span_m = self.range_m
        steps = (self.sum + self.steps_below * self.posts) % 2**32 / self.posts - self.steps_below
        return low_m + steps * span_m / 65535

    def lines(self) -> list[str]:
        a, b, c, d = self.corners
        return [
            f"A  {a:,}      B  {b:,}      north",
            f"C  {c:,}      D  {d:,}      south",
            f"(D - C) - (B - A) = {self.sum:,} steps; the height range has 65,535 steps",
            f"{self.posts:,} posts, mean height {metres(self.mean_m)}",
            "A box of any size takes four fetches: green corners add, red corners subtract.",
            "Sums wrap at 2^32, hence the bands. Differences stay exact.",
        ]


def box_around(renderer: Renderer, place: np.ndarray, side: int) -> BoxSum:
    """Look up the box around a place in world metres, in the GPU's table: at most `side` entries a side."""
    heightmap = renderer.heightmap
    east, north = heightmap.spacing_m
    post = round(float(place[0] / east)), round(float(heightmap.rows - 1 - place[1] / north))
    table = renderer.picture.sums.table_over(*post)
    cols, rows = table.size
    col, row = ((at - corner) >> table.level for at, corner in zip(post, table.corner, strict=True))
    x0, y0 = max(0, min(col - side // 2, cols - 1)), max(0, min(row - side // 2, rows - 1))
    x1, y1 = min(x0 + side, cols), min(y0 + side, rows)

    def fetch(x: int, y: int) -> int:
        if x == 0 or y == 0:
            return 0
        word = table.first + (y - 1) * table.width + x - 1
        return int.from_bytes(table.buffer.read(4, offset=4 * word), "little")

    corners = fetch(x0, y0), fetch(x1, y0), fetch(x0, y1), fetch(x1, y1)
    low_m, span_m = quantisation_range(*heightmap.quantised_m)[1:]
    below = max(0, math.ceil((low_m - heightmap.range_m[0]) / span_m * 65535))
    return BoxSum(table, (x0, y0, x1, y1), corners, (low_m, span_m), below)
