"""The goal of a mesh: the error or the number of triangles that a level-of-detail method must keep to."""

from dataclasses import dataclass
from typing import Any

import numpy as np

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


def _float_below(value: float) -> np.float32:
    """The largest float32 that is not above a value."""
    nearest = np.float32(value)
    return nearest if float(nearest) <= value else np.nextafter(nearest, np.float32(0))
