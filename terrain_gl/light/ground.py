"""The summed-area table of heights that shading reads, and the direction of the sun."""

import math
from typing import NamedTuple

import moderngl

from ..basics.rect import Rect
from ..camera import Vector
from ..gpu.passes import Resources, Uniforms
from ..sat import Table
from ..terrain import Terrain, steps_per_m
from .recorded import RecordedTable


class SumsTable(NamedTuple):
    """A summed-area table of heights: of a map in memory, or of one tile of a store.

    Attributes
    ----------
    buffer, first
        Where it is on the GPU, and the number of its first word there.
    size
        Columns and rows.
    width
        Words from one row to the next.
    corner, level
        Column and row of the map's post of its first entry. The next entries are 2^level posts apart.
    """

    buffer: moderngl.Buffer
    first: int
    size: tuple[int, int]
    width: int
    corner: tuple[int, int] = (0, 0)
    level: int = 0


class HeightSums(RecordedTable):
    """Summed-area table of heights in 16-bit steps, 4 bytes a post. It gives the mean height and slope of any box."""

    def __init__(self, terrain: Terrain) -> None:
        size = Table(terrain.heightmap.cols, terrain.heightmap.rows)
        super().__init__(terrain.ctx, size, "shade/quantise.comp", "a table of heights")
        self.terrain = terrain
        self.build()

    def update(self, posts: Rect) -> None:
        """Follow an edit of the posts of columns x0 to x1 and rows y0 to y1, (x0, y0, x1, y1)."""
        self._rewrite(posts[0], posts[1], posts[2] - posts[0] + 1, posts[3] - posts[1] + 1)

    @property
    def resources(self) -> Resources:
        """What shaders read of the sums: glsl/shade/posts.glsl."""
        return {"HeightSums": self.buffer, "u_height_sums": self.texture}

    def table_over(self, col: int, row: int) -> SumsTable:
        """The table that holds the sums over a post: one table holds those of the whole map."""
        heightmap = self.terrain.heightmap
        return SumsTable(self.buffer, 0, (heightmap.cols, heightmap.rows), heightmap.cols)

    def _feed(self, buffer: moderngl.Buffer, where: Uniforms) -> tuple[Resources, Uniforms]:
        read = {**self.terrain.resources, "Words": buffer}
        return read, {**where, "steps_per_m": steps_per_m(self.terrain.span_m)}


def towards_sun(azimuth_deg: float, elevation_deg: float) -> Vector:
    """Unit vector (east, north, up) towards the sun; the azimuth is clockwise from north."""
    azimuth, elevation = math.radians(azimuth_deg), math.radians(elevation_deg)
    flat = math.cos(elevation)
    return flat * math.sin(azimuth), flat * math.cos(azimuth), math.sin(elevation)
