"""The heightmap on the GPU: its heights, its voids, and the block that tells every shader its sizes."""

from __future__ import annotations

import math

import moderngl
import numpy as np

from . import gl, layout
from .exceptions import TerrainError
from .heightmap import Heightmap

Rect = tuple[int, int, int, int]


class Terrain:
    """A heightmap's textures and its `Terrain` block (glsl/blocks/terrain.glsl).

    Attributes
    ----------
    base_m
        What the GPU's heights are counted from: 0, or close below the map where that keeps float32 exact.
    levels
        Sizes of the quadtree's levels.
    filled
        (rows, cols) float32 heights with voids filled from their rim.
    """

    def __init__(self, ctx: moderngl.Context, heightmap: Heightmap) -> None:
        self.ctx, self.heightmap = ctx, heightmap
        size = (heightmap.cols, heightmap.rows)
        most = gl.limits(ctx)["texture_size"]
        if max(size) > most:
            raise TerrainError(
                f"{heightmap.name}: {size[0]}x{size[1]} posts, but this GPU's textures end at {most}: use a smaller map"
            )
        self.levels = layout.quadtree(*size)
        self.heights = self._texture(size, "f4")
        self.voids = self._texture(size if heightmap.voids else (1, 1), "u1")
        self.block = ctx.buffer(reserve=layout.TERRAIN.itemsize)
        self.upload()

    @property
    def top_level(self) -> int:
        """Level of the one node over the whole map."""
        return len(self.levels) - 1

    def upload(self) -> None:
        """Send the whole heightmap as it is now."""
        has_voids = self.heightmap.voids > 0
        self.filled = fill_voids(self.heightmap.heights)
        self.base_m, low_m, self.span_m = measure_span(*self.heightmap.range_m)
        self._write((0, 0, self.heightmap.cols - 1, self.heightmap.rows - 1), has_voids)
        self.block.write(self._describe(low_m).tobytes())

    def edit(self, heightmap: Heightmap) -> Rect | None:
        """Take the same map with some posts changed; returns the rectangle (x0, y0, x1, y1) that differs, if any.

        Posts differ also where a changed rim fills a void anew. Everything that follows from the map's span is new
        when the span or the presence of voids changes: the rectangle is the whole map then.
        """
        before, had_voids, old_span = self.filled, self.heightmap.voids > 0, measure_span(*self.heightmap.range_m)
        old_void = np.isnan(self.heightmap.heights)
        self.heightmap = heightmap
        has_voids = heightmap.voids > 0
        if measure_span(*heightmap.range_m) != old_span or has_voids != had_voids:
            self.voids.release()
            self.voids = self._texture(self.heights.size if has_voids else (1, 1), "u1")
            self.upload()
            return 0, 0, heightmap.cols - 1, heightmap.rows - 1
        self.filled = fill_voids(heightmap.heights)
        changed = (before != self.filled) | (old_void != np.isnan(heightmap.heights))
        rows, cols = np.flatnonzero(changed.any(1)), np.flatnonzero(changed.any(0))
        if not len(rows):
            return None
        rect = int(cols[0]), int(rows[0]), int(cols[-1]), int(rows[-1])
        self._write(rect, has_voids)
        return rect

    def bind(self) -> None:
        """Make the map visible to every shader, at the places that glsl/blocks/terrain.glsl names."""
        self.block.bind_to_uniform_block(0)
        self.heights.use(0)
        self.voids.use(1)

    def release(self) -> None:
        """Give the GPU's memory back."""
        for resource in (self.heights, self.voids, self.block):
            resource.release()

    def _texture(self, size: tuple[int, int], dtype: str) -> moderngl.Texture:
        texture = self.ctx.texture(size, 1, dtype=dtype)
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        return texture

    def _write(self, rect: Rect, has_voids: bool) -> None:
        x0, y0, x1, y1 = rect
        part = np.s_[y0 : y1 + 1, x0 : x1 + 1]
        viewport = (x0, y0, x1 - x0 + 1, y1 - y0 + 1)
        heights = self.filled[part] - np.float32(self.base_m) if self.base_m else self.filled[part]
        self.heights.write(np.ascontiguousarray(heights), viewport=viewport)
        if has_voids:
            voids = np.isnan(self.heightmap.heights[part]).astype("u1")
            self.voids.write(voids, viewport=viewport, alignment=1)

    def _describe(self, low_m: float) -> np.ndarray:
        block = np.zeros((), layout.TERRAIN)
        block["last_post"] = self.heightmap.cols - 1, self.heightmap.rows - 1
        block["spacing_m"] = self.heightmap.spacing_m
        block["top_level"] = self.top_level
        block["low_m"], block["span_m"] = low_m - self.base_m, self.span_m
        block["has_voids"] = self.heightmap.voids > 0
        for j, level in enumerate(self.levels):
            block["level"][j] = tuple(level)
        return block


def measure_span(low: float, high: float) -> tuple[float, float, float]:
    """Base, lowest value and span of a map's heights, on a coarse binary grid that small edits do not shift.

    The base is 0 unless the map stands so far from 0 that heights lose digits; subtracting it is then exact.
    """
    relief = max(high - low, 1e-6 * max(abs(low), 1.0))
    step = 2.0 ** (math.ceil(math.log2(relief)) - 2)
    bottom = math.floor(low / step) * step
    span = math.ceil((max(high, low + relief) - bottom) / step) * step
    far = min(abs(low), abs(high)) >= span and (low > 0) == (high > 0)
    return (bottom if far else 0.0), bottom, span


def fill_voids(heights: np.ndarray) -> np.ndarray:
    """Heights with NaN replaced by averages that grow inward from the rim (pull-push, Gortler et al. 1996)."""
    void = np.isnan(heights)
    if not void.any():
        return heights
    coarse = fill_voids(_pull(heights))
    up = coarse.repeat(2, 0).repeat(2, 1)[: heights.shape[0], : heights.shape[1]]
    return np.where(void, up, heights).astype(np.float32)


def _pull(heights: np.ndarray) -> np.ndarray:
    """Halve a map: the mean of the known ones of each 2 × 2 heights."""
    rows, cols = heights.shape
    padded = np.pad(heights, ((0, rows % 2), (0, cols % 2)), constant_values=np.nan)
    blocks = padded.reshape(padded.shape[0] // 2, 2, padded.shape[1] // 2, 2)
    known = np.isfinite(blocks).sum((1, 3))
    total = np.nansum(blocks, (1, 3), dtype=np.float64)
    return np.where(known > 0, total / np.maximum(known, 1), np.nan).astype(np.float32)
