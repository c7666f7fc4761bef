"""The heightmap on the GPU: textures of heights and of marks, and the uniform block that describes the map."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import moderngl
import numpy as np

from ..basics.exceptions import TerrainError
from ..basics.rect import Area, Rect
from ..gpu import gl, layout
from ..gpu.packing import MOST_SPANS, STEPS
from ..gpu.passes import Resources
from ..heightmap import Heightmap, units_for
from .filling import Filling
from .water import water_posts

KEPT_SPANS = 2  # an edit keeps the units if old and new heights lie in so many spans
SEA = 0.1  # if this share of the rim is in water of one height, that water is the sea


class Terrain:
    """A heightmap's textures and its `Terrain` block (glsl/blocks/terrain.glsl).

    Parameters
    ----------
    like
        A terrain of the same posts: its water is used again. If it has the same heights, so are its filled voids.
    least_top
        The level of the one node over the whole map is at least this.
    filled
        The heights with voids filled, (rows, cols), as for a part of a filled map; None to fill them here.

    Attributes
    ----------
    base_m
        The GPU's heights are relative to this height: 0, or a height close below the map if float32 needs it.
    span_m
        Width of the quantisation range. Tables store heights and errors as fractions of this width.
    levels
        Sizes of the levels of nodes.
    """

    streams = False  # whether parts of the map may be missing on the GPU

    def __init__(
        self,
        ctx: moderngl.Context,
        heightmap: Heightmap,
        like: Terrain | None = None,
        least_top: int = 1,
        filled: np.ndarray | None = None,
    ) -> None:
        self.ctx = ctx
        self.heightmap = heightmap
        self.edits = 0  # the number of edits that have changed the map
        self._own = False  # whether `heightmap` is our own copy, which we may change
        same = like is not None and like.heightmap.heights is heightmap.heights
        self._filling: Filling | None = like._filling if like and same else None
        self._filled = filled
        self._water: Water | None = like._water if like else Water.of(heightmap.heights)
        size = (heightmap.cols, heightmap.rows)
        most = gl.limits(ctx)["texture_size"]
        if max(size) > most:
            raise TerrainError(
                f"{heightmap.name}: {size[0]}x{size[1]} posts, but this GPU's textures end at {most}:"
                " draw it from a store (terrain-gl build)"
            )
        self.levels = layout.levels_over(*size, least_top)
        self.heights = gl.texel_texture(self.ctx, size, "f4")
        self.marks = self._make_marks()
        self.block = ctx.buffer(reserve=layout.TERRAIN.itemsize)
        self._send()

    @property
    def all_posts(self) -> Rect:
        """The rectangle of all posts."""
        return 0, 0, self.heightmap.cols - 1, self.heightmap.rows - 1

    @property
    def top_level(self) -> int:
        """Level of the one node over the whole map."""
        return len(self.levels) - 1

    @property
    def coarsest_ring(self) -> int:
        """The coarsest ring of the clipmap that the map needs."""
        return self.top_level

    @property
    def has_water(self) -> bool:
        """Whether water was found in the map's heights: see `water.water_posts`."""
        return self._water is not None

    @property
    def sea_m(self) -> float | None:
        """Height of the sea that continues beyond the map; None if the map has no sea."""
        return self._water.sea_m if self._water else None

    @property
    def is_marked(self) -> bool:
        """Whether any posts are marked, as void or as water."""
        return self.heightmap.voids > 0 or self.has_water

    @property
    def filled(self) -> np.ndarray:
        """(rows, cols) float32 heights with voids filled from their rim."""
        if self._filled is not None:
            return self._filled
        return self._filling.filled[0] if self._filling else self.heightmap.heights

    def has_voids_around(self, col: int, row: int) -> bool:
        """Whether one of the four cells around a post has no data. The post is not on the map's rim."""
        return bool(np.isnan(self.heightmap.heights[row - 1 : row + 2, col - 1 : col + 2]).any())

    def upload(self) -> None:
        """Upload the whole heightmap."""
        self._filling = None
        self._send()

    def _send(self) -> None:
        has_voids = self.heightmap.voids > 0
        if has_voids and not self._filling and self._filled is None:
            self._filling = Filling(self.heightmap.heights)
        self.base_m, _, self.span_m = quantisation_range(*self.heightmap.quantised_m)
        self._write(self.all_posts)
        self.block.write(self._describe().tobytes())

    def edit(self, x: int, y: int, heights: np.ndarray) -> Rect | None:
        """Give the posts from column x and row y on new heights, (rows, cols), NaN for voids.

        The time grows with the number of posts that change. Everything is uploaded again only if the heights need other
        units (`units_suit`), or if the first void appears or the last one disappears.

        Returns
        -------
        Rect, optional
            The rectangle of columns and rows (x0, y0, x1, y1) that changed, filled voids included; None if no post did.
        """
        self._own_heights()
        had_voids = self.heightmap.voids > 0
        changed = self.heightmap.write(x, y, heights)
        if changed is None:
            return None
        self.edits += 1
        rows, cols = changed
        has_voids = self.heightmap.voids > 0
        fresh_m = units_for(self.heightmap.range_m, self.heightmap.ground_spacing_m)
        has_units = units_suit(self.heightmap.quantised_m, fresh_m)
        if not has_units:
            self.heightmap.quantised_m = fresh_m
        if not has_units or has_voids != had_voids:
            self.marks.release()
            self.marks = self._make_marks()
            self.upload()
            return self.all_posts
        rect = cols.start, rows.start, cols.stop - 1, rows.stop - 1
        if self._filling:
            rect = self._filling.update(rect)
        self._write(rect)
        self.block.write(self._describe().tobytes())
        return rect

    def with_heights(self, heights: np.ndarray) -> Terrain:
        """The same posts with other heights, (rows, cols) metres, NaN for voids. Water keeps its place and height."""
        other = self.heightmap.copy(heights)
        other.quantised_m = self.heightmap.quantised_m
        return Terrain(self.ctx, other, self)

    def exaggerate(self, factor: float) -> None:
        """Draw the relief `factor` times as high: see `Heightmap.exaggerated`. Tables of errors stay as they are."""
        self.heightmap = self.heightmap.exaggerated(factor)
        self.block.write(self._describe().tobytes())

    defines: Mapping[str, object] = MappingProxyType({})  # macros of all passes over this map

    @property
    def resources(self) -> Resources:
        """What shaders read of the map: glsl/blocks/terrain.glsl."""
        return {"Terrain": self.block, "u_heights": self.heights, "u_marks": self.marks}

    def boxes(self, low: np.ndarray, high: np.ndarray, heights_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """World boxes over parts of the map: smallest and largest corners, (n, 3) metres.

        The boxes reach from columns and rows `low` to `high`, (n, 2); `high` may lie beyond the map. `heights_m` are
        their lowest and highest heights above the base, (n, 2).
        """
        last = np.array([self.heightmap.cols - 1, self.heightmap.rows - 1])
        east, north = self.heightmap.spacing_m
        high = np.minimum(high, last)
        z = heights_m + self.base_m
        south_west = [low[:, 0] * east, (last[1] - high[:, 1]) * north, z[:, 0]]
        return np.stack(south_west, -1), np.stack([high[:, 0] * east, (last[1] - low[:, 1]) * north, z[:, 1]], -1)

    def release(self) -> None:
        """Release GPU resources."""
        for resource in (self.heights, self.marks, self.block):
            resource.release()

    def _own_heights(self) -> None:
        """Copy the heights before the first edit, so that the caller's map does not change."""
        if not self._own:
            self.heightmap = self.heightmap.copy()
            self._own = True
            if self._filling:
                self._filling.known[0] = self.heightmap.heights

    def _make_marks(self) -> moderngl.Texture:
        """A texture for the marks of all posts; one mark, of nothing, if the map has none."""
        if self.is_marked:
            return gl.texel_texture(self.ctx, self.heights.size, "u1")
        texture = gl.texel_texture(self.ctx, (1, 1), "u1")
        texture.write(b"\0", alignment=1)  # a new texture may hold anything
        return texture

    def _write(self, rect: Rect) -> None:
        x0, y0, x1, y1 = rect
        part = np.s_[y0 : y1 + 1, x0 : x1 + 1]
        viewport = (x0, y0, x1 - x0 + 1, y1 - y0 + 1)
        heights = self.filled[part] - np.float32(self.base_m) if self.base_m else self.filled[part]
        self.heights.write(np.ascontiguousarray(heights), viewport=viewport)
        if self.is_marked:
            known = self.heightmap.heights[part]
            marks = np.where(np.isnan(known), layout.VOID, 0).astype("u1")
            if self._water:
                marks[self._water.stands(part, known)] |= layout.WET
            self.marks.write(marks, viewport=viewport, alignment=1)

    def _describe(self) -> np.ndarray:
        block = block_of(self.heightmap, self.top_level)
        for j, level in enumerate(self.levels):
            for name, value in level._asdict().items():
                block["level"][j][name] = value
        return block


def block_of(heightmap: Heightmap, top_level: int) -> np.ndarray:
    """The block `layout.TERRAIN` of a map, without its levels."""
    base_m, low_m, span_m = quantisation_range(*heightmap.quantised_m)
    lowest_m, highest_m = heightmap.range_m
    beyond_m = np.maximum((low_m - lowest_m, highest_m - (low_m + span_m)), 0.0)
    block = np.zeros((), layout.TERRAIN)
    block["last_post"] = heightmap.cols - 1, heightmap.rows - 1
    block["spacing_m"] = heightmap.spacing_m
    block["top_level"] = top_level
    block["low_m"] = low_m - base_m
    block["beyond_m"] = np.float32(beyond_m * (1 + 2.0**-20))  # rounded up
    block["span_m"] = span_m
    block["class_octaves"] = layout.class_octaves(span_m, heightmap.ground_spacing_m)
    block["has_voids"] = heightmap.voids > 0
    return block


class Water(NamedTuple):
    """The posts that were in water when the map was opened, and the water's heights.

    A post is dry after an edit has moved it from that height.
    """

    posts: np.ndarray
    levels_m: np.ndarray
    sea_m: float | None

    @classmethod
    def of(cls, heights: np.ndarray) -> Water | None:
        """The water that is found in a map's heights."""
        posts = water_posts(heights)
        if posts is None:
            return None
        rim = _rim_of(posts)
        return cls(posts, np.unique(heights[posts]), sea_of(_rim_of(heights)[rim], len(rim)))

    def stands(self, part: Area, heights: np.ndarray) -> np.ndarray:
        """Which posts of a part of the map are in water now."""
        return self.posts[part] & np.isin(heights, self.levels_m)


def sea_of(heights: np.ndarray, rim: int) -> float | None:
    """The height of the sea; None if there is none. `heights` are those of wet posts of the rim, out of `rim` posts."""
    levels, counts = np.unique(heights, return_counts=True)
    is_sea = counts.size > 0 and counts.max() >= SEA * rim
    return float(levels[counts.argmax()]) if is_sea else None


def _rim_of(values: np.ndarray) -> np.ndarray:
    """The values of the posts at a map's rim."""
    return np.concatenate([values[0], values[-1], values[1:-1, 0], values[1:-1, -1]])


def steps_per_m(span_m: float) -> float:
    """Number of steps in a metre of height. The quantisation range has 65,535 steps (glsl/shade/relief.glsl)."""
    return STEPS / span_m


def steps_of(heights: np.ndarray, low_m: float, span_m: float) -> np.ndarray:
    """Heights above the base as steps, uint32; as glsl/shade/quantise.comp, bit for bit. `low_m` is above the base."""
    steps = (heights.astype(np.float32) - np.float32(low_m)) * np.float32(steps_per_m(span_m))
    return np.rint(steps).astype(np.int32).view(np.uint32)


def units_suit(units_m: tuple[float, float], fresh_m: tuple[float, float]) -> bool:
    """Whether an edit keeps the tables' units. Units for the new heights, `fresh_m`, would hardly be better."""
    return units_hold(units_m, fresh_m, KEPT_SPANS) and units_hold(fresh_m, units_m, KEPT_SPANS)


def units_hold(units_m: tuple[float, float], range_m: tuple[float, float], most_spans: int = MOST_SPANS) -> bool:
    """Whether tables in units for one range of heights can hold another range.

    Heights may lie in `most_spans` spans. And the heights that the GPU stores, above the base, must be exact.
    """
    base_m, bottom_m, span_m = quantisation_range(*units_m)
    low, high = min(range_m[0], bottom_m), max(range_m[1], bottom_m + span_m)
    is_exact = base_m == 0 or min(range_m[0] / base_m, range_m[1] / base_m) >= 0.5
    return is_exact and high - low <= most_spans * span_m


def quantisation_range(low: float, high: float) -> tuple[float, float, float]:
    """Base, lowest value and width of the quantisation range that holds heights from `low` to `high`.

    The range lies on a coarse binary grid, so that small edits do not shift it. The GPU stores heights above the base.
    The base is 0, unless the map is so far from 0 that float32 would lose digits; subtracting it is then exact.
    """
    relief = max(high - low, 1e-6 * max(abs(low), 1.0))
    step = 2.0 ** (math.ceil(math.log2(relief)) - 2)
    bottom = math.floor(low / step) * step
    span = math.ceil((max(high, low + relief) - bottom) / step) * step
    far = min(abs(low), abs(high)) >= span and (low > 0) == (high > 0)
    return (bottom if far else 0.0), bottom, span
