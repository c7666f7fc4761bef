"""The result of a level-of-detail method: the patches to draw, and their certified error."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from .hiding import NO_HIDING, Hiding
from .surface import MeshBuffers, Surface


@dataclass(frozen=True)
class Selection:
    """The mesh of a view: a value, which another choice does not change.

    Attributes
    ----------
    surface
        Draws the patches.
    buffers
        What the GPU reads of this mesh alone.
    settings
        The fields of the `View` block that it was chosen with, beside the camera.
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
        Number of indirect commands in `buffers`.
    price
        With a budget of least squares, or a mean: the squared pixels that one more triangle would have to remove; 0 if
        none can.
    hidden
        Number of patches that were chosen but are hidden. Their records follow those of the drawn patches.
    hiding
        How these patches were found.
    farthest_px
        The bound of a point, if `certified_px` is that of a mean over the picture.
    cracks
        Number of edges whose two sides have different vertices, if patches do not agree on edges (`lod.cracks`).
    """

    surface: Surface = field(compare=False)
    buffers: MeshBuffers = field(compare=False)
    settings: Mapping[str, Any] = field(compare=False)
    counts: tuple[int, ...]
    triangles: int
    most_triangles: int
    splits: int
    certified_px: float | None
    draws: int
    price: float | None = None
    hidden: int = 0
    hiding: Hiding = NO_HIDING
    farthest_px: float | None = None
    cracks: int | None = None

    @property
    def patches(self) -> int:
        """Patches of all sizes."""
        return sum(self.counts)
