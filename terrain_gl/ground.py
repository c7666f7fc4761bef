"""What shading knows of the map: sums of its heights, how much of the sun each post sees, what kind of land it is."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import moderngl
import numpy as np

from . import gl, shaders
from .camera import Vector
from .heightmap import Heightmap
from .sat import SummedAreaTables, Table
from .terrain import Rect, Terrain

_FETCH = moderngl.TEXTURE_FETCH_BARRIER_BIT | moderngl.TEXTURE_UPDATE_BARRIER_BIT | moderngl.SHADER_STORAGE_BARRIER_BIT


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


class SunMap:
    """How much of the sun each post sees, a byte a post and its mipmaps: glsl/shade/sun_sweep.comp."""

    def __init__(self, terrain: Terrain) -> None:
        self.ctx, self.terrain = terrain.ctx, terrain
        self._sweep: Any = shaders.compute(self.ctx, "shade/sun_sweep.comp")
        self.texture = self.ctx.texture((terrain.heightmap.cols, terrain.heightmap.rows), 1)
        self.texture.build_mipmaps()  # a texture without them is incomplete: shaders could not write to it
        self.texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
        self.texture.repeat_x = self.texture.repeat_y = False
        self._sun: Vector | None = None

    @property
    def bytes(self) -> int:
        """GPU memory of the map and its mipmaps."""
        return self.texture.width * self.texture.height * 4 // 3

    def forget(self) -> None:
        """The heights have changed."""
        self._sun = None

    def follow(self, sun: Vector) -> None:
        """Make the map for a direction towards the sun, unless it is there already."""
        if sun == self._sun:
            return
        self._sun = sun
        lines, threads = self._aim(sun)
        shadow = self.ctx.buffer(reserve=8 * threads)
        self.terrain.bind()
        shadow.bind_to_storage_buffer(1)
        self.texture.bind_to_image(0, read=False, write=True)
        for line in range(lines):
            self._sweep["u_line"] = line
            self._sweep.run(-(-threads // 64))
            self.ctx.memory_barrier(moderngl.SHADER_STORAGE_BARRIER_BIT)
        self.ctx.memory_barrier(_FETCH)
        shadow.release()
        self.texture.build_mipmaps()

    def release(self) -> None:
        """Give the GPU's memory back."""
        self.texture.release()
        self._sweep.release()

    def _aim(self, sun: Vector) -> tuple[int, int]:
        """Set the sweep's direction: lines are crossed at most one post askew; returns lines and posts in one."""
        east_m, north_m = self.terrain.heightmap.spacing_m
        along, down = sun[0] / east_m, -sun[1] / north_m  # posts towards the sun
        by_column = abs(along) >= abs(down)
        major, minor = (along, down) if by_column else (down, along)
        metres = 1 / max(abs(major), 1e-9)  # along the ground from line to line; endless if the sun is overhead
        self._sweep["u_by_column"], self._sweep["u_backward"] = by_column, major > 0
        self._sweep["u_shift"] = minor / max(abs(major), 1e-9)
        self._sweep["u_fall_m"] = min(metres * sun[2], 1e30)
        self._sweep["u_soft_m"] = max(0.5 * metres * abs(sun[2]), 0.05 * min(east_m, north_m))
        size = self.texture.size
        return size if by_column else size[::-1]


def towards_sun(azimuth_deg: float, elevation_deg: float) -> Vector:
    """Unit vector east, north, up; azimuth clockwise from north."""
    azimuth, elevation = math.radians(azimuth_deg), math.radians(elevation_deg)
    flat = math.cos(elevation)
    return flat * math.sin(azimuth), flat * math.cos(azimuth), math.sin(elevation)
