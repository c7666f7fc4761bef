"""The baselines: methods that we compare our own with.

A baseline has parameters that trade triangles for accuracy. It certifies no error; its achieved error is measured like
that of every method. `curves.detail_of` finds the best parameters for a number of triangles.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from ..basics.rect import Rect
from ..camera import Camera
from ..gpu import gl
from ..gpu.buffer_pool import BufferPool
from ..lod import Goal, Selection
from ..renderer.methods import Selectors
from ..renderer.options import Parameters
from .pyramid import Pyramid


class Baseline:
    """A mesh of rings around the eye: a `surface.Surface` that is its own `methods.Selector`.

    A subclass defines the other fields of a surface, and the methods below that raise NotImplementedError.
    """

    defines: Mapping[str, object] = MappingProxyType({})
    on_heights = False

    def __init__(self, selectors: Selectors) -> None:
        self.terrain = selectors.terrain
        self.ctx = self.terrain.ctx
        self.view = selectors.view
        self.pyramid = selectors.shared(pyramid)
        self.commands = BufferPool(self.ctx, gl.COMMAND_STRIDE)
        self._fitted: tuple[Any, Parameters] | None = None  # a view, and the parameters found for it

    def choose(self, camera: Camera, size: tuple[int, int], near_m: float, goal: Goal) -> Selection:
        """Choose the mesh for a picture of `size`, by the parameters of the goal or by default ones."""
        raise NotImplementedError

    def candidates(
        self, camera: Camera, size: tuple[int, int], near_m: float, triangles: int, between: bool = False
    ) -> Sequence[Parameters]:
        """Parameters that give about `triangles` triangles in the picture, the best guess first.

        With `between`, also parameters with vertices between posts.
        """
        raise NotImplementedError

    def select(self, camera: Camera, size: tuple[int, int], near_m: float, goal: Goal) -> Selection:
        """`choose`, also by a number of triangles; the metric is not used."""
        if goal.triangles and not goal.parameters:
            view = camera, size, near_m, goal.triangles
            if self._fitted is None or self._fitted[0] != view:
                self._fitted = view, self.candidates(*view)[0]
            goal = replace(goal, parameters=self._fitted[1])
        return self.choose(camera, size, near_m, goal)

    def update(self, posts: Rect) -> None:
        """Follow an edit: parameters must be fitted again."""
        self._fitted = None


def pyramid(selectors: Selectors) -> Pyramid:
    """The pyramid of heights that the baselines share."""
    return Pyramid(selectors.terrain)
