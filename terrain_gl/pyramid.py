"""The pyramid of heights that clipmaps draw from: each level a filtered half of the one below, down to two posts a side.

    level 0  the map itself
    level j  sample i stands on post min(i · 2^j, last): ceil((posts − 1) / 2^j) + 1 samples, whatever the map's size

Specification: `reference.halve`.
"""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np

from . import layout, shaders
from .terrain import Rect, Terrain

# weights of a symmetric filter's middle, its neighbours and theirs
FILTERS = {
    "point": (1.0, 0.0, 0.0),  # every second sample as it is
    "tent": (0.5, 0.25, 0.0),  # the binomial filter, Burt 1981
    "spline": (0.75, 0.25, -0.125),  # Cohen, Daubechies, Feauveau 1992: made for lines drawn between the samples
}
_BARRIER = moderngl.TEXTURE_FETCH_BARRIER_BIT | moderngl.TEXTURE_UPDATE_BARRIER_BIT
_TAPS = 2  # samples on either side that a filter reads


class Pyramid:
    """Levels 1 and above in one texture; glsl/clipmap/pyramid.glsl looks them up.

    Parameters
    ----------
    terrain
        Whose heights; voids are filled there.
    kind
        One of `FILTERS`.
    """

    def __init__(self, terrain: Terrain, kind: str = "spline") -> None:
        self.ctx, self.terrain, self.weights = terrain.ctx, terrain, FILTERS[kind]
        self.sizes = [(columns + 1, rows + 1) for (columns, rows), *_ in terrain.levels]
        self._halve: Any = shaders.compute(self.ctx, "clipmap/halve.comp")
        self._first = _places(self.sizes)
        width = max(x + size[0] for (x, _), size in zip(self._first[1:], self.sizes[1:], strict=True))
        height = max(y + size[1] for (_, y), size in zip(self._first[1:], self.sizes[1:], strict=True))
        self._texture = self.ctx.texture((width, height), 1, dtype="f4")
        self._texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self._block = self.ctx.buffer(reserve=16 * layout.MAX_LEVELS)
        self._block.write(np.array([(*first, 0, 0) for first in self._first], "i4").tobytes())
        self.build()

    @property
    def bytes(self) -> int:
        """GPU memory of all levels but the map."""
        return 4 * self._texture.width * self._texture.height

    def build(self) -> None:
        """Make all levels."""
        columns, rows = self.sizes[0]
        self.update((0, 0, columns - 1, rows - 1))

    def update(self, posts: Rect) -> None:
        """Follow an edit of the posts of columns x0 to x1 and rows y0 to y1, (x0, y0, x1, y1)."""
        self.bind()
        self._texture.bind_to_image(0, read=False, write=True)
        self._halve["u_weights"] = self.weights
        low, high = np.array(posts[:2]), np.array(posts[2:])
        for level, size in list(enumerate(self.sizes))[1:]:
            low, high = np.maximum(low - _TAPS, 0) // 2, np.minimum((high + _TAPS + 1) // 2 + 1, size)
            self._halve["u_to"], self._halve["u_first"], self._halve["u_end"] = level, tuple(low), tuple(high)
            self._halve.run(-(-int(high[0] - low[0]) // 64), int(high[1] - low[1]))
            self.ctx.memory_barrier(_BARRIER)
            high = high - 1

    def bind(self) -> None:
        """Make terrain and pyramid visible to every shader."""
        self.terrain.bind()
        self._block.bind_to_uniform_block(3)
        self._texture.use(5)

    def read(self) -> list[np.ndarray]:
        """Heights of every level, (rows, cols) float32 metres above the terrain's base."""
        all_levels = np.frombuffer(self._texture.read(), "f4").reshape(self._texture.height, self._texture.width)
        above = [all_levels[y : y + h, x : x + w] for (x, y), (w, h) in zip(self._first, self.sizes, strict=True)]
        return [self.terrain.filled - np.float32(self.terrain.base_m), *above[1:]]

    def release(self) -> None:
        """Give the GPU's memory back."""
        for resource in (self._texture, self._block, self._halve):
            resource.release()


def _places(sizes: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Column and row of each level's first texel: level 1 on the left, those above it in a column to its right."""
    places, y = [(0, 0), (0, 0)], 0
    for _, height in sizes[2:]:
        places.append((sizes[1][0], y))
        y += height
    return places
