"""The result of a level-of-detail method: the patches to draw, and their certified error."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .surface import Surface

METRICS = ("max", "rms")  # what a tolerance in pixels bounds, or a budget minimises
METRES = "metres"  # takes the place of a metric if the tolerance is in metres
INFINITE_PX = 9e29  # errors above this are infinite; a little below INFINITE_PX of glsl/lod/project.glsl


@dataclass(frozen=True)
class Goal:
    """The goal of a mesh: a tolerance, a number of triangles, or a baseline's own parameters.

    Attributes
    ----------
    tolerance_px
        The largest screen error, or root mean square, in pixels; in metres with `METRES`. With 0, every post is drawn.
    metric
        The error that the tolerance bounds, or that the budget minimises: one of `METRICS`, or `METRES`.
    cull
        Leave out patches outside the picture.
    triangles
        Instead of a tolerance: the largest number of triangles, at least 2.
    hides
        Leave out land that is hidden behind other land. It has an effect only with `cull`.
    has_holes
        Nothing is drawn over posts without data.
    parameters
        Parameters of a baseline, instead of tolerance and triangles. Other methods have none.
    """

    tolerance_px: float = 0.0
    metric: str = "max"
    cull: bool = True
    triangles: int | None = None
    parameters: Any = None
    hides: bool = False
    has_holes: bool = False

    @property
    def is_priced(self) -> bool:
        """Whether a patch may be over the tolerance: with a budget, and with a mean over the picture."""
        return self.triangles is not None or self.metric == "rms"

    @property
    def settings(self) -> dict[str, Any]:
        """The fields of the `View` block that decide the level of detail."""
        metric = (*METRICS, METRES).index("max" if self.triangles else self.metric)  # budgets are certified in "max"
        return {"tolerance_px": _float_below(self.tolerance_px), "metric": metric, "cull": self.cull}


@dataclass(frozen=True)
class Selection:
    """The mesh of a view.

    Attributes
    ----------
    surface
        Draws the patches.
    counts
        Number of patches by size: 1, 2, 4, ... segments a side.
    triangles
        Triangles of the patches, without those that have no area.
    most_triangles
        An upper bound of the triangles that the GPU makes, those without area included.
    splits
        Leaves smaller than their block.
    certified_px
        The bound of the screen error over all drawn patches, in the requested metric; in metres with `METRES`; None if
        nothing is certified.
    draws
        Number of indirect commands in the surface's buffer `draws`.
    price
        With a budget of least squares, or a mean: the squared pixels that one more triangle would have to remove; 0 if
        none can.
    hidden
        Number of patches that were chosen but are hidden. In the surface's `patches`, their records follow those of
        the drawn patches.
    farthest_px
        The bound of a point, if `certified_px` is that of a mean over the picture.
    cracks
        Number of edges whose two sides have different vertices, if patches do not agree on edges (`lod.cracks`).
    """

    surface: Surface = field(compare=False)
    counts: tuple[int, ...]
    triangles: int
    most_triangles: int
    splits: int
    certified_px: float | None
    draws: int
    price: float | None = None
    hidden: int = 0
    farthest_px: float | None = None
    cracks: int | None = None

    @property
    def patches(self) -> int:
        """Patches of all sizes."""
        return sum(self.counts)


def _float_below(value: float) -> np.float32:
    """The largest float32 that is not above a value."""
    nearest = np.float32(value)
    return nearest if float(nearest) <= value else np.nextafter(nearest, np.float32(0))
