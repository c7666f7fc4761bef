"""The truth as a mesh: every post, and nearly the bilinear surface between four posts.

A cell can be drawn as two triangles in two ways. One diagonal lies as far above the bilinear surface as the other lies
below it, and the driver chooses the diagonal. Near the eye the difference is many pixels. So we cut each cell in four;
the heights at the middles of its edges and at its centre are means of its posts.

    ┌───────┐      ┌───┬───┐       Posts and edges are the same as in the full resolution of every method.
    │     ╱ │      │ ╱ │ ╱ │
    │   ╱   │      ├───┼───┤       The centre lies on the bilinear surface. The largest error is a quarter
    │ ╱     │      │ ╱ │ ╱ │       of that of two triangles.
    └───────┘      └───┴───┘
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import moderngl
import numpy as np

from ..basics.rect import Rect
from ..camera import Camera
from ..gpu import gl
from ..gpu.passes import Resources
from ..lod import Goal, Selection
from ..lod.patches import OfPatches
from ..renderer.methods import Selectors, quadtree

FINER = 2  # segments for each segment of a full-resolution patch


class Bilinear:
    """The true surface; a `surface.Surface` that draws the patches of the full resolution with twice the segments."""

    stages = OfPatches.stages
    defines: Mapping[str, object] = MappingProxyType({"FINER": FINER})  # in the picture alone: glsl/mesh/patch.tesc
    on_heights = True
    mode = moderngl.PATCHES
    indices = None

    def __init__(self, selectors: Selectors) -> None:
        self.selector = selectors.shared(quadtree)
        self.ctx = self.selector.ctx
        self.terrain = self.selector.terrain
        self.view = self.selector.view
        self.draws = self.ctx.buffer(reserve=gl.COMMAND_STRIDE)

    @property
    def feed(self) -> list[tuple[Any, ...]]:
        """The vertex buffer: each patch is one vertex."""
        return self.selector.feed

    @property
    def resources(self) -> Resources:
        """Everything that the stages read."""
        return self.selector.resources

    @property
    def bytes(self) -> int:
        """GPU memory of the draw commands."""
        return self.draws.size

    def select(self, camera: Camera, size: tuple[int, int], near_m: float, goal: Goal) -> Selection:
        """Choose every patch in the picture. Triangles are counted as two for each cell of the map.

        Nothing is certified, because errors are measured against this surface. The rest of the goal is not used.
        """
        full = self.selector.select(camera, size, near_m, Goal(cull=goal.cull))
        commands = np.array(list(_commands(full.counts)) or [(0,) * 5], "u4")
        self.draws = gl.at_least(self.ctx, self.draws, commands.nbytes)
        self.draws.write(commands.tobytes())
        draws = len(commands) if full.draws else 0
        most = FINER**2 * full.most_triangles
        return replace(full, surface=self, most_triangles=most, certified_px=None, draws=draws)

    def update(self, posts: Rect) -> None:
        """Follow an edit. There is nothing to do, because the patches come from the quadtree."""

    def release(self) -> None:
        """Release GPU resources."""
        self.draws.release()


def _commands(counts: tuple[int, ...]) -> Iterator[tuple[int, int, int, int, int]]:
    """Draw commands for patches, size by size; each makes at most `gl.MOST_VERTICES` vertices."""
    first = 0
    for size, count in enumerate(counts):
        most = gl.MOST_VERTICES // (FINER * 2**size + 1) ** 2
        for begin in range(0, count, most):
            yield min(most, count - begin), 1, first + begin, 0, 0
        first += count
