"""The baselines: methods that we compare our own with.

A baseline has parameters that trade triangles for accuracy. It certifies no error; its achieved error is measured like
that of every method. `curves.detail_of` finds the best parameters for a number of triangles.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from ..basics.rect import Rect
from ..camera import Camera
from ..lod import Goal, Selection
from ..renderer.methods import Selectors
from .clipmap import Clipmap, Rings
from .pyramid import Pyramid
from .tessellated import Edges, Tessellated

Parameters = Rings | Edges
PARAMETERS: dict[str, Callable[[], Parameters]] = {"clipmap": Rings, "tessellated": Edges}


class Baseline:
    """A `methods.Selector`: chooses a baseline's mesh by its parameters, or by a number of triangles.

    Parameters
    ----------
    surface
        The baseline.
    """

    def __init__(self, surface: Clipmap | Tessellated) -> None:
        self.surface = surface
        self._fitted: tuple[Any, Parameters] | None = None  # a view, and the parameters found for it

    @property
    def bytes(self) -> int:
        """GPU memory of blocks or patches."""
        return int(self.surface.bytes)

    def select(self, camera: Camera, size: tuple[int, int], near_m: float, goal: Goal) -> Selection:
        """Choose the mesh for a picture of `size`; the metric is not used."""
        if goal.triangles and not goal.parameters:
            goal = replace(goal, parameters=self._fit(camera, size, near_m, goal.triangles))
        return self.surface.select(camera, size, near_m, goal)

    def candidates(
        self, camera: Camera, size: tuple[int, int], near_m: float, triangles: int, between: bool = False
    ) -> list[Parameters]:
        """Parameters that give about `triangles` triangles, the best guess first.

        With `between`, also parameters with vertices between posts.
        """
        return [*self.surface.candidates(camera, size, near_m, triangles, between)]

    def update(self, posts: Rect) -> None:
        """Follow an edit: parameters must be fitted again."""
        self._fitted = None

    def release(self) -> None:
        """Release GPU resources."""
        self.surface.release()

    def _fit(self, *view: Any) -> Parameters:
        """Find parameters; for the same view, return those of the last call."""
        if self._fitted is None or self._fitted[0] != view:
            self._fitted = view, self.candidates(*view)[0]
        return self._fitted[1]


def pyramid(selectors: Selectors) -> Pyramid:
    """The pyramid of heights that the baselines share."""
    return Pyramid(selectors.terrain)


def clipmap(selectors: Selectors) -> Baseline:
    """Geometry clipmaps."""
    return Baseline(Clipmap(selectors.terrain, selectors.view, selectors.shared(pyramid)))


def tessellated(selectors: Selectors) -> Baseline:
    """Clipmaps with hardware tessellation."""
    return Baseline(Tessellated(selectors.terrain, selectors.view, selectors.shared(pyramid)))
