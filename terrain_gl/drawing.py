"""How a frame is to be drawn, in one record: what `Renderer.render`, the commands and the window all speak of."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .camera import Camera
from .exceptions import UsageError
from .lod import METRICS
from .methods.rivals import PARAMETERS, Parameters
from .shade import STYLES, SUN, Look

METHODS = ("sat", "clipmap", "tessellated", "full", "truth")
EVERY_POST = ("full", "truth")
CHOICES = {"metric": METRICS, "method": METHODS, "style": STYLES}


@dataclass(frozen=True)
class Drawing:
    """Options of one frame; the keywords of `Renderer.render` and `Renderer.draw`.

    Attributes
    ----------
    max_error_px
        The largest distance on the screen between where a post of the map is drawn and where it belongs
        (metric "max"), or the root mean square of all those distances ("rms"). By default 1, unless a number of
        triangles is asked for. Rivals promise nothing, and heed it not.
    triangles
        Instead: at most so many, from 2 on, used where they take most from the sum of the squares of those distances,
        which counts posts near the eye as often as they are pixels across.
    metric
        "max" or "rms": what the tolerance bounds, and what is certified of the mesh.
    method
        "sat"; a rival, "clipmap" or "tessellated"; "full" for every post in the picture; or "truth", which is bilinear
        between posts, too.
    parameters
        How finely a rival draws, `clipmap.Rings` or `tessellated.Edges`; by default as `triangles` asks for, or theirs.
    style
        One of `terrain_gl.shade.STYLES`.
    sun
        Azimuth, clockwise from north, and elevation, in degrees.
    sky, material, water_m
        As `terrain_gl.shade.Look` has them: files, and metres.
    near_m
        Distance of the near plane; by default a tenth of the smaller spacing.
    cull
        Leave out patches that the picture does not show.
    wires
        Draw the triangles' edges over whatever the style shows.
    chosen_for
        Choose the mesh for the picture that this camera would see, though it is looked at from elsewhere.

    Raises
    ------
    UsageError
        A value outside its range.
    """

    max_error_px: float | None = None
    triangles: int | None = None
    metric: str = "max"
    method: str = "sat"
    parameters: Parameters | None = None
    style: str = "shaded"
    sun: tuple[float, float] = SUN
    sky: str | None = None
    material: str | None = None
    water_m: float | None = None
    near_m: float | None = None
    cull: bool = True
    wires: bool = False
    chosen_for: Camera | None = None

    def __post_init__(self) -> None:
        self._check_detail()
        if self.near_m is not None and not 0 < self.near_m < 1e9:
            raise UsageError(f"near plane must stand more than 0 and less than 1e9 metres away, got {self.near_m:g}")
        if not (np.shape(self.sun) == (2,) and np.isfinite(self.sun).all() and -90 <= self.sun[1] <= 90):
            raise UsageError(f"sun: expected azimuth and elevation, -90 to 90 degrees, got {self.sun}")
        if self.water_m is not None and not math.isfinite(self.water_m):
            raise UsageError(f"water must stand at a finite height in metres, got {self.water_m:g}")
        for name, known in CHOICES.items():
            if (value := getattr(self, name)) not in known:
                raise UsageError(f"{name}: expected one of {', '.join(known)}, got {value!r}")

        if self.parameters and not isinstance(self.parameters, PARAMETERS.get(self.method, ())):
            raise UsageError(f"{type(self.parameters).__name__.lower()}: method {self.method} has no such parameter")

    def _check_detail(self) -> None:
        if self.triangles is None:
            if self.max_error_px is None:
                object.__setattr__(self, "max_error_px", 1.0)
            elif not 0 < self.max_error_px < 1e6:
                raise UsageError(
                    f"max error must be more than 0 and less than 1,000,000 pixels, got {self.max_error_px:g}"
                )
        elif self.parameters:
            raise UsageError("triangles and a rival's own parameters: give one of them, the other follows")
        elif self.max_error_px is not None:
            raise UsageError("max error and triangles: give one of them, the other follows")
        elif self.method in EVERY_POST:
            raise UsageError(
                f"triangles: method {self.method} draws every post; choose another method or leave triangles out"
            )
        elif not 2 <= self.triangles < 2**31 or self.triangles != int(self.triangles):
            raise UsageError(f"triangles must be a whole number from 2 on and less than 2^31, got {self.triangles}")

    def otherwise(self, **changes: Any) -> Drawing:
        """The same but for `changes`, and for what does not go with them: it is as if it had never been chosen."""
        dropped: dict[str, Any] = {}
        method = changes.get("method", self.method)
        if changes.get("triangles") is not None:
            dropped = {"max_error_px": None, "parameters": None}
            dropped |= {"method": "sat"} if method in EVERY_POST else {}
        elif method in EVERY_POST or changes.get("parameters") or changes.get("max_error_px") is not None:
            dropped = {"triangles": None}
        if method != self.method:
            dropped["parameters"] = None
        return replace(self, **dropped | changes)

    @property
    def look(self) -> Look:
        """The part of it that shading wants to know."""
        return Look(self.style, self.sun, self.sky, self.material, self.water_m, self.wires)

    @property
    def tolerance_px(self) -> float:
        """What the mesh is held to; 0 for every post."""
        return 0.0 if self.method in EVERY_POST or self.max_error_px is None else self.max_error_px
