"""The heightmap on the GPU: textures of heights and voids, and the block of sizes that every shader reads."""

from __future__ import annotations

import math
from copy import copy

import moderngl
import numpy as np

from .exceptions import TerrainError, UsageError
from .gpu import gl, layout
from .gpu.bindings import bind
from .heightmap import MAX_HEIGHT_M, Heightmap

Rect = tuple[int, int, int, int]
HEADROOM = 0.5  # headroom for further edits when the quantisation range is widened, as a part of the relief


class Terrain:
    """A heightmap's textures and its `Terrain` block (glsl/blocks/terrain.glsl).

    Attributes
    ----------
    base_m
        The height that the GPU's heights are relative to: 0, or a height close below the map if float32 needs it.
    span_m
        Width of the quantisation range: the tables store heights and errors as integers in units of it.
    levels
        Sizes of the quadtree's levels.
    edits
        The number of edits that have changed the map.
    """

    def __init__(self, ctx: moderngl.Context, heightmap: Heightmap, filling: Filling | None = None) -> None:
        self.ctx, self.heightmap = ctx, heightmap
        self.edits = 0
        self._own = False  # whether `heightmap` is this terrain's alone, to be written to
        self._filling = filling
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
    def headroom_m(self) -> tuple[float, float]:
        """How far edits may go below the lowest post and above the highest before everything is rebuilt, in metres.

        Infinite if the quantisation range ends at `MAX_HEIGHT_M`, the limit for all heights.
        """
        (low, high), top_m = self.heightmap.range_m, self._low_m + self.span_m
        down_m = low - self._low_m if self._low_m > -MAX_HEIGHT_M else math.inf
        return down_m, top_m - high if top_m < MAX_HEIGHT_M else math.inf

    @property
    def filled(self) -> np.ndarray:
        """(rows, cols) float32 heights with voids filled from their rim."""
        return self._filling.filled[0] if self._filling else self.heightmap.heights

    def upload(self) -> None:
        """Upload the whole heightmap."""
        self._filling = None
        self._send()

    def _send(self) -> None:
        has_voids = self.heightmap.voids > 0
        if has_voids and not self._filling:
            self._filling = Filling(self.heightmap.heights)
        self.base_m, self._low_m, self.span_m = quantisation_range(*self.heightmap.quantised_m)
        self._write(self.all_posts, has_voids)
        self.block.write(self._describe().tobytes())

    def edit(self, x: int, y: int, heights: np.ndarray) -> Rect | None:
        """Give the posts from column x and row y on new heights, (rows, cols), NaN for voids.

        The time grows with the number of posts that change, not with the map. Everything is uploaded again only if
        heights leave the quantisation range, or if the first void appears or the last one disappears. A range that is
        left is widened with headroom and never shrinks again (`Heightmap.quantised_m`). The first edit copies the
        heights, so the caller's map does not change.

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
        has_voids, in_range = self.heightmap.voids > 0, min(self.headroom_m) >= 0
        if not in_range:
            self._widen_range()
        if not in_range or has_voids != had_voids:
            self.voids.release()
            self.voids = self._texture(self.heights.size if has_voids else (1, 1), "u1")
            self.upload()
            return self.all_posts
        rect = cols.start, rows.start, cols.stop - 1, rows.stop - 1
        if self._filling:
            rect = self._filling.update(rect)
        self._write(rect, has_voids)
        return rect

    def with_headroom(self, up_m: float, down_m: float = 0.0) -> Terrain | None:
        """A copy of the map with a wider quantisation range, to `take` later; None if the range is wide enough.

        The new range holds heights `up_m` above the highest post and `down_m` below the lowest. The copy does not
        contain later edits.

        Raises
        ------
        UsageError
            A number of metres that is negative or not finite.
        """
        if not (0 <= up_m < math.inf and 0 <= down_m < math.inf):
            raise UsageError(f"headroom must be 0 or more metres up and down, got {up_m:g} and {down_m:g}")
        self._own_heights()
        (low, high), held = self.heightmap.range_m, self.heightmap.quantised_m
        wide = copy(self.heightmap)
        low, high = max(low - down_m, -MAX_HEIGHT_M), min(high + up_m, MAX_HEIGHT_M)  # no edit goes further
        wide.quantised_m = min(held[0], low), max(held[1], high)
        if quantisation_range(*wide.quantised_m) == (self.base_m, self._low_m, self.span_m):
            self.heightmap.quantised_m = wide.quantised_m
            return None
        return Terrain(self.ctx, wide, self._filling)

    def take(self, wider: Terrain) -> None:
        """Exchange quantisation range, textures and block with the copy from `with_headroom`."""
        mine, theirs = self.heightmap, wider.heightmap
        mine.quantised_m, theirs.quantised_m = theirs.quantised_m, mine.quantised_m
        for name in ("heights", "voids", "block", "base_m", "_low_m", "span_m"):
            old, new = getattr(self, name), getattr(wider, name)
            setattr(self, name, new)
            setattr(wider, name, old)

    def bind(self) -> None:
        """Bind the map for all shaders."""
        bind("blocks/terrain.glsl", Terrain=self.block, u_heights=self.heights, u_voids=self.voids)

    def boxes(self, low: np.ndarray, high: np.ndarray, heights_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """World boxes over parts of the map: smallest and largest corners, (n, 3) metres.

        Parameters
        ----------
        low, high
            (n, 2) columns and rows of their north-west and south-east posts; `high` may lie beyond the map.
        heights_m
            (n, 2) lowest and highest height above the base.
        """
        last = np.array([self.heightmap.cols - 1, self.heightmap.rows - 1])
        (east, north), high, z = self.heightmap.spacing_m, np.minimum(high, last), heights_m + self.base_m
        south_west = [low[:, 0] * east, (last[1] - high[:, 1]) * north, z[:, 0]]
        return np.stack(south_west, -1), np.stack([high[:, 0] * east, (last[1] - low[:, 1]) * north, z[:, 1]], -1)

    def release(self) -> None:
        """Release GPU resources."""
        for resource in (self.heights, self.voids, self.block):
            resource.release()

    def _own_heights(self) -> None:
        """Copy the heights before the first edit, so that the caller's map does not change."""
        if not self._own:
            self.heightmap, self._own = self.heightmap.copy(), True
            if self._filling:
                self._filling.known[0] = self.heightmap.heights

    def _widen_range(self) -> None:
        """Widen the quantisation range on each side that heights have left, with headroom for further edits."""
        low, high = self.heightmap.range_m
        held_low, held_high = self.heightmap.quantised_m
        headroom_m = HEADROOM * (max(high, held_high) - min(low, held_low))
        self.heightmap.quantised_m = (
            low - headroom_m if low < self._low_m else held_low,
            high + headroom_m if high > self._low_m + self.span_m else held_high,
        )

    def _texture(self, size: tuple[int, int], dtype: str) -> moderngl.Texture:
        texture = self.ctx.texture(size, 1, dtype=dtype)
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        texture.repeat_x = texture.repeat_y = False  # gathers beyond the rim repeat the rim
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

    def _describe(self) -> np.ndarray:
        block = np.zeros((), layout.TERRAIN)
        block["last_post"] = self.heightmap.cols - 1, self.heightmap.rows - 1
        block["spacing_m"] = self.heightmap.spacing_m
        block["top_level"] = self.top_level
        block["low_m"], block["span_m"] = self._low_m - self.base_m, self.span_m
        block["has_voids"] = self.heightmap.voids > 0
        for j, level in enumerate(self.levels):
            block["level"][j] = tuple(level)
        return block


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


def hull(a: Rect, b: Rect) -> Rect:
    """The smallest rectangle that contains two."""
    return min(a[0], b[0]), min(a[1], b[1]), max(a[2], b[2]), max(a[3], b[3])


def fill_voids(heights: np.ndarray) -> np.ndarray:
    """Heights with NaN replaced by averages that grow inward from the rim."""
    return Filling(heights).filled[0] if np.isnan(heights).any() else heights


class Filling:
    """Heights with voids filled, pull-push (Gortler et al. 1996, "The lumigraph"), and ready for edits.

    A pyramid: each level up is half as large, its posts the means of the known ones below; down again, what is void
    takes the height above.

        known   5 ·     pull    5        filled   5 5
                · ·      →                →       5 5

    Attributes
    ----------
    known, filled
        Levels from the map, (rows, cols), up to a single post; NaN in `known` where void.
    """

    def __init__(self, heights: np.ndarray) -> None:
        self.known = [heights]
        while self.known[-1].size > 1:
            self.known.append(_pull(self.known[-1]))
        self.filled = [self.known[-1]]
        for known in self.known[-2::-1]:
            self.filled.insert(0, _push(known, self.filled[0]))

    def update(self, posts: Rect) -> Rect:
        """Follow new heights of the map in a rectangle (x0, y0, x1, y1); returns the one in which `filled` differs."""
        rects = [posts]
        for below, known in zip(self.known, self.known[1:], strict=False):
            x0, y0, x1, y1 = (i // 2 for i in rects[-1])
            known[y0 : y1 + 1, x0 : x1 + 1] = _pull(below[2 * y0 : 2 * y1 + 2, 2 * x0 : 2 * x1 + 2])
            rects.append((x0, y0, x1, y1))
        changed = rects[-1]
        for level in range(len(self.known) - 2, -1, -1):
            changed = self._push_again(level, rects[level], changed)
        self.filled[-1] = self.known[-1]
        return changed

    def _push_again(self, level: int, posts: Rect, above: Rect) -> Rect:
        """Fill one level anew below what changed above; returns the rectangle that differs, `posts` within it."""
        known, filled = self.known[level], self.filled[level]
        (rows, cols), (x0, y0, x1, y1) = known.shape, above
        y, x = slice(2 * y0, min(2 * y1 + 2, rows)), slice(2 * x0, min(2 * x1 + 2, cols))
        new = _push(known[y, x], self.filled[level + 1][y0 : y1 + 1, x0 : x1 + 1])
        differs = new != filled[y, x]
        filled[y, x] = new
        at_y, at_x = np.flatnonzero(differs.any(1)) + y.start, np.flatnonzero(differs.any(0)) + x.start
        if not len(at_y):
            return posts
        return hull(posts, (int(at_x[0]), int(at_y[0]), int(at_x[-1]), int(at_y[-1])))


def _push(known: np.ndarray, above: np.ndarray) -> np.ndarray:
    """Fill the voids of a level from the one above."""
    up = above.repeat(2, 0).repeat(2, 1)[: known.shape[0], : known.shape[1]]
    return np.where(np.isnan(known), up, known).astype(np.float32, copy=False)


def _pull(heights: np.ndarray) -> np.ndarray:
    """Halve a map: the mean of the known ones of each 2 × 2 heights."""
    rows, cols = heights.shape
    padded = np.pad(heights, ((0, rows % 2), (0, cols % 2)), constant_values=np.nan)
    blocks = padded.reshape(padded.shape[0] // 2, 2, padded.shape[1] // 2, 2)
    known = np.isfinite(blocks).sum((1, 3))
    total = np.nansum(blocks, (1, 3), dtype=np.float64)
    return np.where(known > 0, total / np.maximum(known, 1), np.nan).astype(np.float32)
