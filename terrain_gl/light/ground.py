"""What shading knows of the map's heights: their sums over any box."""

from __future__ import annotations

import math
from typing import Any

import moderngl

from .. import gl, shaders
from ..camera import Vector
from ..sat import SummedAreaTables, Table
from ..terrain import Rect, Terrain


class HeightSums:
    """Summed-area table of a terrain's heights in 16-bit steps, four bytes a post: mean height and slope of any box."""

    def __init__(self, terrain: Terrain) -> None:
        self.ctx, self.terrain = terrain.ctx, terrain
        self.table = Table(terrain.heightmap.cols, terrain.heightmap.rows)
        self._sat = SummedAreaTables(self.ctx, 32)
        self._quantise: Any = shaders.compute(self.ctx, "shade/quantise.comp")
        self.buffer = gl.reserve(self.ctx, 4 * self.table.words, "a table of heights")
        self.build()

    @property
    def bytes(self) -> int:
        """GPU memory of the table."""
        return self.buffer.size

    def build(self) -> None:
        """Sum all heights."""
        self._write(self.buffer, (0, 0), self.table)
        self._sat.build(self.buffer, self.table)

    def update(self, posts: Rect) -> None:
        """Follow an edit of the posts of columns x0 to x1 and rows y0 to y1, (x0, y0, x1, y1)."""
        x, y = posts[:2]
        at = Table(posts[2] - x + 1, posts[3] - y + 1)
        if at == self.table:
            self.build()
            return
        values = self.ctx.buffer(reserve=4 * at.words)
        self._write(values, (x, y), at)
        self._sat.edit(self.buffer, self.table, values, at, x, y)
        values.release()

    def release(self) -> None:
        """Give the GPU's memory back."""
        for resource in (self.buffer, self._sat, self._quantise):
            resource.release()

    def _write(self, buffer: moderngl.Buffer, first: tuple[int, int], at: Table) -> None:
        self.terrain.bind()
        buffer.bind_to_storage_buffer(0)
        self._quantise["u_first"], self._quantise["u_count"] = first, at[:2]
        self._quantise.run(-(-at.width // 64), at.height)
        self.ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)


def towards_sun(azimuth_deg: float, elevation_deg: float) -> Vector:
    """Unit vector east, north, up; azimuth clockwise from north."""
    azimuth, elevation = math.radians(azimuth_deg), math.radians(elevation_deg)
    flat = math.cos(elevation)
    return flat * math.sin(azimuth), flat * math.cos(azimuth), math.sin(elevation)
