"""The methods that `lod` is compared with: each knows one number to trade triangles for nearness to the truth by.

They promise nothing. What they achieve is measured like everything else.
"""

from __future__ import annotations

from typing import Any

from ..camera import Camera
from ..lod import Selection, View
from ..terrain import Rect, Terrain
from .clipmap import Clipmap, Rings
from .pyramid import Pyramid
from .tessellated import Edges, Tessellated

RIVALS: dict[str, Any] = {"clipmap": Clipmap, "tessellated": Tessellated}
PARAMETERS: dict[str, Any] = {"clipmap": Rings, "tessellated": Edges}
Parameters = Rings | Edges


class Rivals:
    """The rivals of one terrain, and the pyramid that they share, made when first needed.

    Parameters
    ----------
    terrain, view
        The map, and the camera block to write.
    """

    def __init__(self, terrain: Terrain, view: View) -> None:
        self._terrain, self._view = terrain, view
        self._pyramid: Pyramid | None = None
        self._made: dict[str, Any] = {}
        self._fitted: dict[str, tuple[Any, Parameters]] = {}

    @property
    def bytes(self) -> int:
        """GPU memory of pyramid, blocks and patches."""
        return sum(part.bytes for part in (self._pyramid, *self._made.values()) if part)

    def of(self, method: str) -> Any:
        """A rival by its name, one of `RIVALS`."""
        self._pyramid = self._pyramid or Pyramid(self._terrain)
        if method not in self._made:
            self._made[method] = RIVALS[method](self._terrain, self._view, self._pyramid)
        return self._made[method]

    def select(
        self,
        method: str,
        camera: Camera,
        size: tuple[int, int],
        near_m: float,
        parameters: Parameters | None = None,
        triangles: int | None = None,
        **settings: Any,
    ) -> Selection:
        """Choose what to draw: by the parameters given, or by those that make about so many triangles."""
        if triangles and not parameters:
            parameters = self._fit(method, camera, size, near_m, triangles)
        return self.of(method).select(camera, size, near_m, parameters or PARAMETERS[method](), **settings)

    def update(self, posts: Rect) -> None:
        """Follow an edit of the posts of columns x0 to x1 and rows y0 to y1, (x0, y0, x1, y1)."""
        self._fitted = {}
        if self._pyramid:
            self._pyramid.update(posts)

    def release(self) -> None:
        """Give the GPU's memory back."""
        for part in (*self._made.values(), self._pyramid):
            if part:
                part.release()

    def _fit(self, method: str, *view: Any) -> Parameters:
        """Find parameters, or take those of the last time if it was for the same view."""
        if self._fitted.get(method, (None,))[0] != view:
            self._fitted[method] = view, self.of(method).candidates(*view)[0]
        return self._fitted[method][1]
