"""The pyramid of heights for clipmaps: each level is the level below, filtered and halved, down to two posts a side.

    level 0  the map itself
    level j  sample i is at post min(i · 2^j, last); there are ceil((posts − 1) / 2^j) + 1 samples, for any size of map

Specification: `halve`.
"""

from functools import reduce

import moderngl
import numpy as np

from ..basics.boxes import over_blocks
from ..basics.rect import Rect
from ..gpu import gl, layout
from ..gpu.passes import ComputePass, Resources
from ..terrain import Terrain

# symmetric filter for linear interpolation (Cohen, Daubechies, Feauveau 1992): centre, first and second neighbours
WEIGHTS = (0.75, 0.25, -0.125)
_BARRIER = moderngl.TEXTURE_FETCH_BARRIER_BIT | moderngl.TEXTURE_UPDATE_BARRIER_BIT
FIRST_RANGES = 2  # the finest level whose ranges are kept
_ENDS = (np.minimum, np.maximum)
_TAPS = 2  # samples that a filter reads on each side


class Pyramid:
    """Levels 1 and above in one texture, read by glsl/comparison/clipmap/pyramid.glsl; voids are filled."""

    def __init__(self, terrain: Terrain) -> None:
        self.ctx = terrain.ctx
        self.terrain = terrain
        self.sizes = [(columns + 1, rows + 1) for (columns, rows), *_ in terrain.levels]
        self._halve = ComputePass(self.ctx, "comparison/clipmap/halve.comp")
        self._first = _places(self.sizes)
        width = max(x + size[0] for (x, _), size in zip(self._first[1:], self.sizes[1:], strict=True))
        height = max(y + size[1] for (_, y), size in zip(self._first[1:], self.sizes[1:], strict=True))
        self._texture = gl.texel_texture(self.ctx, (width, height), "f4")
        self._block = self.ctx.buffer(reserve=16 * layout.MAX_LEVELS)
        self._block.write(np.array([(*first, 0, 0) for first in self._first], "i4").tobytes())
        self._ranges: list[np.ndarray] = []
        self._errors_m = np.zeros(0)
        self.update((0, 0, self.sizes[0][0] - 1, self.sizes[0][1] - 1))

    @property
    def bytes(self) -> int:
        """GPU memory of all levels except the map."""
        return 4 * self._texture.width * self._texture.height

    def update(self, posts: Rect) -> None:
        """Follow an edit of the posts of columns x0 to x1 and rows y0 to y1, (x0, y0, x1, y1)."""
        self._ranges = []
        self._errors_m = np.zeros(0)
        resources: Resources = {**self.resources, "u_out": self._texture}
        low, high = np.array(posts[:2]), np.array(posts[2:])
        for level, size in list(enumerate(self.sizes))[1:]:
            low, high = np.maximum(low - _TAPS, 0) // 2, np.minimum((high + _TAPS + 1) // 2 + 1, size)
            uniforms = {"weights": WEIGHTS, "to": level, "first": tuple(low), "end": tuple(high)}
            groups = -(-int(high[0] - low[0]) // 64), int(high[1] - low[1]), 1
            self._halve.run(groups, resources, uniforms)
            self.ctx.memory_barrier(_BARRIER)
            high = high - 1

    @property
    def resources(self) -> Resources:
        """What shaders read of terrain and pyramid: glsl/comparison/clipmap/pyramid.glsl."""
        return {**self.terrain.resources, "Pyramid": self._block, "u_pyramid": self._texture}

    def read(self) -> list[np.ndarray]:
        """Heights of every level, (rows, cols) float32 metres above the terrain's base."""
        all_levels = np.frombuffer(self._texture.read(), "f4").reshape(self._texture.height, self._texture.width)
        above = [all_levels[y : y + h, x : x + w] for (x, y), (w, h) in zip(self._first, self.sizes, strict=True)]
        return [self.terrain.filled - np.float32(self.terrain.base_m), *above[1:]]

    def ranges(self, at: np.ndarray, level: np.ndarray) -> np.ndarray:
        """Lowest and highest height over cells, of their level and all finer levels: (n, 2) metres above the base.

        `at` (n, 2) are columns and rows of the cells on the lattice of their level. A cell of a level below
        `FIRST_RANGES` has the range of the larger cell that contains it.
        """
        if not self._ranges:
            self._ranges = _ranges(self.read())
        found = np.empty((len(at), 2))
        for j in np.unique(level):
            known = min(max(j, FIRST_RANGES), FIRST_RANGES + len(self._ranges) - 1)
            col, row = at[level == j].T >> abs(j - known)
            found[level == j] = self._ranges[known - FIRST_RANGES][row, col]
        return found

    def errors_m(self) -> np.ndarray:
        """Root mean square error of each level against the map, in metres: (levels,), at 2^16 random posts."""
        if not len(self._errors_m):
            levels = self.read()
            posts = np.random.default_rng(0).integers(0, levels[0].shape, (2**16, 2))
            drawn = np.array([_on_triangles(heights, j, posts, levels[0].shape) for j, heights in enumerate(levels)])
            self._errors_m = np.sqrt(np.square(drawn - drawn[0]).mean(1))
        return self._errors_m

    def release(self) -> None:
        """Release GPU resources."""
        for resource in (self._texture, self._block, self._halve):
            resource.release()


# g(i) = w₀ f(2i) + w₁ (f(2i − 1) + f(2i + 1)) + w₂ (f(2i − 2) + f(2i + 2)); near the rim, the distances 1 and 2 shrink.


def halve(heights: np.ndarray) -> np.ndarray:
    """Every second sample after a symmetric filter along both axes; the last sample is at the last post."""
    for axis in (0, 1):
        lines = np.moveaxis(heights.astype(np.float64), axis, 0)
        last = len(lines) - 1
        middle = np.minimum(2 * np.arange(-(-last // 2) + 1), last)
        reach = [np.minimum(d, np.minimum(middle, last - middle)) for d in (1, 2)]
        halved = WEIGHTS[0] * lines[middle]
        for weight, d in zip(WEIGHTS[1:], reach, strict=True):
            halved += weight * (lines[middle - d] + lines[middle + d])
        heights = np.moveaxis(halved, 0, axis)
    return heights


def _places(sizes: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Column and row of each level's first texel: level 1 is on the left, coarser levels in a column to its right."""
    places = [(0, 0), (0, 0)]
    y = 0
    for _, height in sizes[2:]:
        places.append((sizes[1][0], y))
        y += height
    return places


def _on_triangles(heights: np.ndarray, level: int, posts: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Heights of a level's surface at posts (n, 2), row and column: linear on triangles, diagonals from north-west."""
    last = np.array(shape) - 1
    at = np.minimum(posts >> level, np.array(heights.shape) - 2)
    low, high = at << level, np.minimum(at + 1 << level, last)
    v, u = ((posts - low) / (high - low)).T
    y, x = at.T
    corner = heights.astype(np.float64)
    a, b, c, d = corner[y, x], corner[y, x + 1], corner[y + 1, x], corner[y + 1, x + 1]
    return np.where(u >= v, a + u * (b - a) + v * (d - b), a + v * (c - a) + u * (d - c))


def _ranges(levels: list[np.ndarray]) -> list[np.ndarray]:
    """For the cells of each level from `FIRST_RANGES` on: lowest and highest height of this and all finer levels."""
    ranges: list[np.ndarray] = []
    for heights in levels:
        corners = heights[:-1, :-1], heights[:-1, 1:], heights[1:, :-1], heights[1:, 1:]
        both = [reduce(better, corners) for better in _ENDS]
        if ranges:
            finer = [over_blocks(better, ranges[-1][..., i], 2) for i, better in enumerate(_ENDS)]
            both = [better(*pair) for better, *pair in zip(_ENDS, both, finer, strict=True)]
        ranges.append(np.stack(both, -1))
    return ranges[FIRST_RANGES:] or ranges[-1:]  # very small maps have fewer levels
