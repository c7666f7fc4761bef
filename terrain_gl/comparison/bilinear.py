"""The surface that a map stands for, drawn: every post, and between four of them the bilinear one.

Two triangles for a cell are two guesses: one diagonal lies as far above the bilinear surface as the other lies below
it, and which of them a method draws is the driver's choice. Next to the eye that is many pixels. The truth takes no
side: a cell is cut in four, and the middles of its edges and its own are means of its posts' heights.

    ┌───────┐      ┌───┬───┐       Its posts, and its edges, are those of every method's full resolution.
    │     ╱ │      │ ╱ │ ╱ │
    │   ╱   │      ├───┼───┤       The middle strays from the bilinear surface nowhere; what is left between is
    │ ╱     │      │ ╱ │ ╱ │       a quarter of what the diagonals are about.
    └───────┘      └───┴───┘
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import moderngl
import numpy as np

from ..camera import Camera
from ..filling import Rect
from ..gpu import gl
from ..lod import QuadtreeSelector, Selection
from ..methods import Selectors, quadtree

FINER = 2  # segments for each of a full-resolution patch


class Bilinear:
    """The truth about a terrain; a `surface.Surface` that draws the patches of full resolution twice as finely.

    At posts it errs by nothing; between them by a quarter of what the full resolution does.

    Parameters
    ----------
    selector
        What chooses the patches.
    """

    stages: Mapping[str, str] = MappingProxyType(
        {"vertex": "mesh/patch.vert", "tess_control": "mesh/bilinear.tesc", "tess_evaluation": "mesh/bilinear.tese"}
    )
    defines: Mapping[str, object] = MappingProxyType({"FINER": FINER})
    on_heights = True
    mode = moderngl.PATCHES
    indices = None

    def __init__(self, selector: QuadtreeSelector) -> None:
        self.ctx, self.selector, self.terrain, self.view = selector.ctx, selector, selector.terrain, selector.view
        self.draws = self.ctx.buffer(reserve=gl.COMMAND_STRIDE)

    @property
    def feed(self) -> list[tuple[Any, ...]]:
        """A patch is one vertex."""
        return self.selector.feed

    def bind(self) -> None:
        """Make all that the stages read visible to them."""
        self.selector.bind()

    @property
    def bytes(self) -> int:
        """GPU memory of the draw commands."""
        return self.draws.size

    def select(
        self, camera: Camera, size: tuple[int, int], near_m: float, cull: bool = True, **unused: Any
    ) -> Selection:
        """Choose every patch in the picture; triangles are counted as the map has them, two a cell.

        Nothing is certified: errors are measured from this surface. The other options of a selector are unused.
        """
        full = self.selector.select(camera, size, near_m, 0.0, cull=cull)
        commands = np.array(list(_commands(full.counts)) or [(0,) * 5], "u4")
        self.draws.release()
        self.draws = self.ctx.buffer(commands.tobytes())
        draws = len(commands) if full.draws else 0
        most = FINER**2 * full.most_triangles
        return replace(full, surface=self, most_triangles=most, certified_px=None, draws=draws)

    def update(self, posts: Rect) -> None:
        """Follow an edit: the patches are those of the quadtree, which follows by itself."""

    def release(self) -> None:
        """Release GPU resources."""
        self.draws.release()


def truth(selectors: Selectors) -> Bilinear:
    """The truth, from the patches of the shared quadtree."""
    return Bilinear(selectors.shared(quadtree))


def _commands(counts: tuple[int, ...]) -> Iterator[tuple[int, int, int, int, int]]:
    """Draws of patches, size after size, of no more vertices than one may make."""
    first = 0
    for size, count in enumerate(counts):
        most = gl.MOST_VERTICES // (FINER * 2**size + 1) ** 2
        for begin in range(0, count, most):
            yield min(most, count - begin), 1, first + begin, 0, 0
        first += count
