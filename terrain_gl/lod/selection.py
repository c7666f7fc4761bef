"""What a level-of-detail method returns: which patches to draw, and what is certified of them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..surface import Surface

METRICS = ("max", "rms")  # what a tolerance in pixels bounds; one in metres has `METRES` beside them
METRES = "metres"
INFINITE_PX = 9e29  # glsl/lod/project.glsl has a little more


@dataclass(frozen=True)
class Selection:
    """What a view is drawn with.

    Attributes
    ----------
    surface
        What was selected from, and draws it.
    counts
        Patches of each size: of 1, 2, 4, ... segments a side. Fans count with those of 2.
    triangles
        Triangles that the patches make, those of no area left out.
    most_triangles
        At least as many as the GPU makes of them, those of no area too.
    splits
        Nodes of the quadtree that were split.
    certified_px
        The largest error that any patch may have on the screen, in the metric asked for, in metres with `METRES`; None
        if nothing is promised.
    draws
        Indirect commands in the surface's `draws`.
    price
        With a budget: squared pixels of error that a triangle more would have to take away; 0 where none would.
    """

    surface: Surface = field(compare=False)
    counts: tuple[int, ...]
    triangles: int
    most_triangles: int
    splits: int
    certified_px: float | None
    draws: int
    price: float | None = None

    @property
    def patches(self) -> int:
        """Patches of all sizes."""
        return sum(self.counts)


def float_below(value: float) -> np.float32:
    """Return the largest float32 that is not above a value."""
    nearest = np.float32(value)
    return nearest if float(nearest) <= value else np.nextafter(nearest, np.float32(0))
