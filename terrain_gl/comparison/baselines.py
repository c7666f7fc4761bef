"""The baselines: the methods that ours is compared with.

A baseline has parameters that trade triangles for accuracy. It certifies no error; its achieved error is measured like
that of every method. `fitting` finds the best parameters for a number of triangles.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ..camera import Camera
from ..filling import Rect
from ..lod import Selection
from ..methods import Selectors
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
    default
        Makes the default parameters.
    """

    def __init__(self, surface: Clipmap | Tessellated, default: Callable[[], Parameters]) -> None:
        self.surface: Any = surface
        self._default = default
        self._fitted: tuple[Any, Parameters] | None = None  # a view, and the parameters found for it

    @property
    def bytes(self) -> int:
        """GPU memory of blocks or patches."""
        return int(self.surface.bytes)

    def select(
        self,
        camera: Camera,
        size: tuple[int, int],
        near_m: float,
        tolerance_px: float = 0.0,
        metric: str = "max",
        cull: bool = True,
        triangles: int | None = None,
        parameters: Parameters | None = None,
    ) -> Selection:
        """Choose the mesh for a picture of `size`; the metric is not used."""
        if triangles and not parameters:
            parameters = self._fit(camera, size, near_m, triangles)
        how = parameters or self._default()
        selection: Selection = self.surface.select(camera, size, near_m, how, tolerance_px=tolerance_px, cull=cull)
        return selection

    def candidates(self, camera: Camera, size: tuple[int, int], near_m: float, triangles: int) -> list[Parameters]:
        """Parameters that give about so many triangles, the best guess first."""
        found: list[Parameters] = self.surface.candidates(camera, size, near_m, triangles)
        return found

    def update(self, posts: Rect) -> None:
        """Follow an edit: parameters are fitted anew."""
        self._fitted = None

    def release(self) -> None:
        """Release GPU resources."""
        self.surface.release()

    def _fit(self, *view: Any) -> Parameters:
        """Find parameters; those of the last call are used again for the same view."""
        if self._fitted is None or self._fitted[0] != view:
            self._fitted = view, self.candidates(*view)[0]
        return self._fitted[1]


def pyramid(selectors: Selectors) -> Pyramid:
    """The pyramid of heights that the baselines share."""
    return Pyramid(selectors.terrain)


def clipmap(selectors: Selectors) -> Baseline:
    """Geometry clipmaps."""
    return Baseline(Clipmap(selectors.terrain, selectors.view, selectors.shared(pyramid)), Rings)


def tessellated(selectors: Selectors) -> Baseline:
    """Clipmaps with hardware tessellation."""
    return Baseline(Tessellated(selectors.terrain, selectors.view, selectors.shared(pyramid)), Edges)
