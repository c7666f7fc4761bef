"""The options of a frame: one record for `Renderer.render`, the command line and the viewer.

Each option is declared once, as a field of `FrameOptions`: its default, its choices, and its flags on the command line
with their help. CONTRIBUTING.md says how to add one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, replace
from typing import Any, NamedTuple, Protocol, TypedDict

from ..basics.exceptions import UsageError
from ..basics.words import UNITS
from ..camera import Camera
from ..heightmap import Heightmap
from ..light.climate import AUTO, LOOKS
from ..light.climate import NAMES as LOOK_NAMES
from ..light.ramps import AUTO as RAMP_AUTO
from ..light.ramps import NAMES as RAMPS
from ..light.ramps import Photo, Values
from ..lod import METRICS, Goal
from ..shade.picture import GRAINS, STYLES, SUN, VOIDS, Look
from ..shade.surroundings import SURROUNDINGS
from ..sight import CURVATURES
from .methods import EVERY_POST, METHODS, REGISTRY, REMOVED

NO_SKY = "none"  # value of the option `sky`: the light is as usual, but the sky is transparent
NEAR = 0.1  # default distance of the near plane, in spacings


class Flag(NamedTuple):
    """The flag of an option on the command line.

    Attributes
    ----------
    name
        The flag with its dashes.
    kind
        The function of `cli.values` that parses its value; "choice" for one of the choices, "file" for a file name.
    metavar
        The name of the value in the help.
    """

    name: str
    kind: str
    help: str
    metavar: str | None = None


class Option(NamedTuple):
    """The declaration of an option.

    Attributes
    ----------
    heading
        Its group in the help: "detail", "picture" or "technical"; "" for options without a flag.
    flags
        Its flags on the command line.
    choices
        The allowed values, if it is a choice.
    """

    heading: str = ""
    flags: tuple[Flag, ...] = ()
    choices: tuple[str, ...] = ()


def _option(default: Any, heading: str, *flags: Flag, choices: tuple[str, ...] = ()) -> Any:
    """A field of `FrameOptions` with its declaration."""
    return field(default=default, metadata={"option": Option(heading, flags, choices)})


class Parameters(Protocol):
    """Level of detail of a baseline: `clipmap.Rings` or `tessellated.Edges`."""

    @property
    def method(self) -> str:
        """The name of the baseline that these parameters belong to."""


def near_plane_m(heightmap: Heightmap, near_m: float | None = None, camera: Camera | None = None) -> float:
    """Distance of the near plane: `near_m` if given, else a tenth of the map's smaller spacing; 0 if orthographic."""
    if camera and camera.is_orthographic:
        if near_m is not None:
            raise UsageError("near: an orthographic camera shows all land in front of the eye; move the eye instead")
        return 0.0
    return near_m or NEAR * min(heightmap.spacing_m)


LEAST_EXAGGERATION = 0.01
MOST_EXAGGERATION = 100.0
LOOSEST_PX = 1e6  # tolerances are smaller


class OtherOptions(TypedDict, total=False):
    """The types of all options of a frame but its tolerance."""

    triangles: int | None
    parameters: Parameters | None
    metric: str
    method: str
    style: str
    look: str
    sun: tuple[float, float]
    sky: str | None
    haze: float
    material: str | None
    drape: str | None
    ramp: str
    ramp_range: tuple[float, float] | None
    water_m: float | None
    voids: str
    units: str
    surroundings: str
    grain: str
    contour_m: float | None
    error_scale_px: float | None
    exaggeration: float
    curvature: str
    refraction: float | None
    near_m: float | None
    occlusion: str
    cull: bool
    wires: bool
    chosen_for: Camera | None


class RenderOptions(OtherOptions, total=False):
    """The keywords of `Renderer.render` and of all others that draw, for editors; `FrameOptions` explains them.

    Examples
    --------
    >>> import terrain_gl as tg
    >>> evening: tg.RenderOptions = {"sun": (265.0, 12.0), "haze": 2.0}
    >>> with tg.Renderer(tg.Heightmap([[0, 1], [2, 3]]), (32, 18)) as renderer:
    ...     frame = renderer.render(tg.Camera((-1, -1, 3), (0.5, 0.5, 1)), **evening)
    """

    max_error_px: float | None


@dataclass(frozen=True)
class FrameOptions:
    """Options of one frame; the keywords of `Renderer.render` and `Renderer.draw`.

    Attributes
    ----------
    max_error_px
        The tolerance of the screen error: the distance in pixels between the drawn and the true position of a point of
        the surface. It bounds the largest error (metric "max"), or the root mean square over the drawn land in the
        picture ("rms"). By default 1, unless `triangles` is given. Baselines certify nothing, and ignore it.
    triangles
        Instead of a tolerance: the largest number of triangles, from 2 on. With the metric "max", the mesh is the one
        with the smallest tolerance. With "rms", the triangles are used where they reduce the sum of the squared screen
        errors most. Each post is weighted by the width of a cell in pixels, but at least 1.
    parameters
        Level of detail of a baseline: `clipmap.Rings` or `tessellated.Edges`. By default it follows from `triangles`.
    metric
        "max" or "rms": the error that the tolerance bounds, or that the budget minimises. By default "max"; for a
        budget, "rms".
    method
        One of `renderer.methods.METHODS`: "sat" (the default), which is certified; a baseline, "clipmap" or
        "tessellated"; "full" for every post in the picture; or "truth", the same with the bilinear surface between
        posts.
    style
        One of `terrain_gl.shade.picture.STYLES`.
    sun
        Azimuth, clockwise from true north, and elevation, in degrees.
    look
        How the land is coloured, one of `terrain_gl.light.climate.NAMES`; "auto": by the place that the file gives.
    voids
        Posts without data: "fill" draws a smooth surface through their rim, "hole" draws nothing. No error includes
        them.
    surroundings
        "block": the map is a block of ground on a plain or in its sea; "none": there is only sky around it.
    grain
        "on": near the eye, the shading has bumps and specks finer than the posts' spacing. The mesh does not change.
    contour_m
        Metres between contour lines over any style; 0 for an interval that suits the map's relief. By default none.
    units
        "m" or "ft": the unit of heights on contour lines, of their interval if it is 0, of legends and scale bars.
    error_scale_px
        Styles "error" and "promise": the error at the end of the scale of colours. Colours then follow the square root
        of the error, so that small errors are visible. By default the end is the tolerance, and the scale is linear.
    exaggeration
        How many times higher the relief is drawn, 0.01 to 100. The eye and the target are raised with it. Contour
        lines, colours, water and reported heights stay true. The bound in pixels holds for the picture as drawn.
    curvature
        Whether land far away is drawn lower, because the Earth is round: "on", "off", or "auto", which is "on" for maps
        with a coordinate system whose longer side is at least 50 km, and at most the radius of their planet.
    refraction
        The coefficient k of refraction: air bends light, so the radius in effect is R / (1 - k). 0.13 is usual on the
        Earth.
    sky, material, water_m
        See `terrain_gl.shade.picture.Look`: files, and metres. With the sky "none", alpha is 0 where there is only sky;
        its light is as usual. The plain or the sea around the map is drawn, unless `surroundings` is "none".
    haze
        How much haze there is: 0 for clear air, 1 (the default) as usual.
    drape, ramp, ramp_range
        `drape` is a raster of values that colours the ground instead of `material`. `ramp` is one of
        `light.ramps.NAMES`. `ramp_range` has the values at the ramp's ends; by default they are those of the raster.
        The looks "viridis" and "diverging" also use `ramp_range`, in metres.
    near_m
        Distance of the near plane; by default a tenth of the smaller spacing.
    cull
        Leave out patches outside the picture.
    occlusion
        "on" leaves out land that is hidden behind other land. The picture is the same: docs/hidden.md. It has an effect
        only on method "sat" with a tolerance, and only with `cull`.
    wires
        Draw the triangles' edges on top of the style.
    chosen_for
        Choose the mesh for this camera, and look at it from another one.

    Raises
    ------
    UsageError
        A value outside its range.
    """

    max_error_px: float | None = _option(
        None, "detail", Flag("--max-error", "positive", "screen error (default: 1)", "PX")
    )
    triangles: int | None = _option(
        None, "detail", Flag("--triangles", "count", "at most N, for the least error; of baselines about N", "N")
    )
    parameters: Parameters | None = _option(
        None,
        "detail",
        Flag("--ring", "rings", "clipmap: vertices a ring's side (default: 255)", "N"),
        Flag("--edge", "edges", "tessellated: length of edges (default: 8)", "PX"),
    )
    metric: str = _option(
        "",
        "detail",
        Flag("--metric", "choice", "max: largest error (default); rms: root mean square (default of --triangles)"),
        choices=METRICS,
    )
    method: str = _option(
        "sat",
        "detail",
        Flag("--method", "choice", "; ".join(f"{name}: {method.help}" for name, method in REGISTRY.items())),
        choices=METHODS,
    )
    style: str = _option("shaded", "picture", Flag("--style", "choice", "what is drawn"), choices=STYLES)
    look: str = _option(
        AUTO,
        "picture",
        Flag("--look", "choice", "the land's colours: " + "; ".join(f"{n}: {kind.help}" for n, kind in LOOKS.items())),
        choices=LOOK_NAMES,
    )
    sun: tuple[float, float] = _option(
        SUN, "picture", Flag("--sun", "sun", "degrees clockwise from true north, and upwards", "AZ,EL")
    )
    sky: str | None = _option(
        None,
        "picture",
        Flag("--sky", "file", "light and sun from an equirectangular .hdr or .exr; none: a transparent sky", "FILE"),
    )
    haze: float = _option(
        1.0, "picture", Flag("--haze", "not_negative", "F times as much haze as usual; 0: none (default: 1)", "F")
    )
    material: str | None = _option(
        None, "picture", Flag("--material", "file", "colour of the ground: a picture of the map, north up", "FILE")
    )
    drape: str | None = _option(
        None, "picture", Flag("--drape", "file", "values over the land, in the colours of --ramp: a raster", "FILE")
    )
    ramp: str = _option(
        RAMP_AUTO,
        "picture",
        Flag("--ramp", "choice", "of --drape; auto: diverging for values on both sides of 0, else viridis"),
        choices=RAMPS,
    )
    ramp_range: tuple[float, float] | None = _option(
        None,
        "picture",
        Flag("--range", "span", "ends of the ramp of --drape or --look; or black and white of --material", "LO,HI"),
    )
    water_m: float | None = _option(None, "picture", Flag("--water", "number", "height of standing water", "M"))
    voids: str = _option(
        "fill",
        "picture",
        Flag("--voids", "choice", "posts without data: a surface through their rim, or holes"),
        choices=VOIDS,
    )
    surroundings: str = _option(
        "block",
        "picture",
        Flag("--surroundings", "choice", "block: the map is on a plain, or in its sea; none: only sky is around it"),
        choices=SURROUNDINGS,
    )
    grain: str = _option(
        "on", "picture", Flag("--grain", "choice", "bumps below the posts' spacing, in the light alone"), choices=GRAINS
    )
    contour_m: float | None = _option(
        None,
        "picture",
        Flag("--contours", "interval", "contour lines every M metres, or 40ft, or auto; each fifth is heavy", "M"),
    )
    units: str = _option(
        "m",
        "picture",
        Flag("--units", "choice", "of contours and heights, the legend and the scale"),
        choices=tuple(UNITS),
    )
    error_scale_px: float | None = _option(
        None,
        "picture",
        Flag("--error-scale", "positive", "styles error and promise: the error at the end of the colours", "PX"),
    )
    exaggeration: float = _option(
        1.0,
        "picture",
        Flag("--exaggeration", "positive", "relief F times as high; contours, colours and heights stay true", "F"),
    )
    curvature: str = _option(
        "auto",
        "picture",
        Flag("--curvature", "choice", "the Earth is round; auto: for maps with coordinates, 50 km and larger"),
        choices=CURVATURES,
    )
    refraction: float | None = _option(
        None, "picture", Flag("--refraction", "number", "air bends light; 0.13 on the Earth (default: 0)", "K")
    )
    near_m: float | None = _option(
        None, "technical", Flag("--near", "positive", "near plane (default: 0.1 spacings)", "M")
    )
    occlusion: str = _option(
        "on",
        "detail",
        Flag("--occlusion", "choice", "on: no triangles for hidden land; the picture is the same"),
        choices=("on", "off"),
    )
    cull: bool = _option(True, "")
    wires: bool = _option(False, "")
    chosen_for: Camera | None = _option(None, "")

    def __post_init__(self) -> None:
        if self.method in REMOVED:
            raise UsageError(REMOVED[self.method])
        if not self.metric:
            object.__setattr__(self, "metric", self._usual_metric)
        self._check_detail()
        if self.near_m is not None and not 0 < self.near_m < 1e9:
            raise UsageError(f"near plane must be more than 0 and less than 1e9 metres away, got {self.near_m:g}")
        if not _is_direction(self.sun):
            raise UsageError(f"sun: expected azimuth and elevation, -90 to 90 degrees, got {self.sun}")
        if self.contour_m is not None and not 0 <= self.contour_m < 1e9:
            raise UsageError(f"contours: expected metres between them, or 0 for auto, got {self.contour_m:g}")
        if not LEAST_EXAGGERATION <= self.exaggeration <= MOST_EXAGGERATION:
            raise UsageError(
                f"exaggeration must be from {LEAST_EXAGGERATION:g} to {MOST_EXAGGERATION:g}, got {self.exaggeration:g}"
            )
        if self.error_scale_px is not None and not 0 < self.error_scale_px < LOOSEST_PX:
            raise UsageError(f"error scale: expected more than 0 pixels, got {self.error_scale_px:g}")
        if self.refraction is not None and not 0 <= self.refraction < 1:
            raise UsageError(f"refraction must be from 0 on and below 1, got {self.refraction:g}")
        if not 0 <= self.haze < math.inf:
            raise UsageError(f"haze must be a number from 0 on, got {self.haze:g}")
        if self.drape and self.material:
            raise UsageError("drape and material: give only one of them, both colour the ground")
        if self.ramp_range is not None and not self.ramp_range[0] < self.ramp_range[1]:
            raise UsageError(f"range: expected two numbers, the lower one first, got {self.ramp_range}")
        if self.water_m is not None and not math.isfinite(self.water_m):
            raise UsageError(f"water must have a finite height in metres, got {self.water_m:g}")
        for name, known in CHOICES.items():
            if (value := getattr(self, name)) not in known:
                raise UsageError(f"{name}: expected one of {', '.join(known)}, got {value!r}")
        if self.parameters and self.parameters.method != self.method:
            raise UsageError(f"{type(self.parameters).__name__.lower()}: method {self.method} has no such parameter")

    def _check_detail(self) -> None:
        if self.triangles is None:
            if self.max_error_px is None:
                object.__setattr__(self, "max_error_px", 1.0)
            elif not 0 < self.max_error_px < LOOSEST_PX:
                raise UsageError(f"max error must be above 0 and below 1,000,000 pixels, got {self.max_error_px:g}")
        elif self.parameters:
            raise UsageError("triangles and a baseline's own parameters: give only one of them, it decides the other")
        elif self.max_error_px is not None:
            raise UsageError("max error and triangles: give only one of them, it decides the other")
        elif self.method in EVERY_POST:
            raise UsageError(f"triangles: method {self.method} draws every post; choose another method")
        elif not 2 <= self.triangles < 2**31 or self.triangles != int(self.triangles):
            raise UsageError(f"triangles must be a whole number from 2 on and less than 2^31, got {self.triangles}")

    def otherwise(self, **changes: object) -> FrameOptions:
        """The same options with `changes`. Options that contradict the changes get their defaults."""
        dropped: dict[str, Any] = {}
        method = changes.get("method", self.method)
        if changes.get("triangles") is not None:
            dropped = {"max_error_px": None, "parameters": None}
            dropped |= {"method": "sat"} if method in EVERY_POST else {}
        elif method in EVERY_POST or changes.get("parameters") or changes.get("max_error_px") is not None:
            dropped = {"triangles": None}
        if method != self.method:
            dropped["parameters"] = None
        if self.metric == self._usual_metric:
            dropped["metric"] = ""
        return replace(self, **dropped | changes)

    @property
    def _usual_metric(self) -> str:
        return "rms" if self.triangles else "max"

    @property
    def certified_metric(self) -> str:
        """The metric of the certified bound. For a budget it is always "max"."""
        return "max" if self.triangles else self.metric

    @property
    def shading(self) -> Look:
        """The options of shading: `Look` has fields of the same names."""
        same = {each.name: getattr(self, each.name) for each in fields(Look) if each.name in OPTIONS}
        if self.drape:
            same["material"] = Values(self.drape, self.ramp, self.ramp_range)
        elif self.material:
            same["material"] = Photo(self.material, self.ramp_range)
        is_clear = self.sky == NO_SKY
        return Look(**same | {"sky": None if is_clear else self.sky}, land_colours=self.look, is_clear=is_clear)

    def seen(self, heightmap: Heightmap, camera: Camera) -> Camera:
        """The camera with the curvature of the ground and the exaggeration that the options give.

        `heightmap` is the map without exaggeration.
        """
        bend = heightmap.bend_per_m(self.curvature, self.refraction or 0.0)
        if camera.is_orthographic:
            if self.curvature == "on":
                raise UsageError(
                    "curvature: land is lower the further it is from an eye, an orthographic camera has none"
                )
            bend = 0.0
        if bend != camera.bend_per_m:
            camera = replace(camera, bend_per_m=bend)  # the copy computes its axes again
        return camera if self.exaggeration == 1 else camera.over_exaggerated(self.exaggeration)

    @property
    def goal(self) -> Goal:
        """The options of the level of detail."""
        first = self.tolerance_px, self.metric, self.cull, self.triangles, self.parameters
        hides = self.occlusion == "on" and self.style != "cracks"  # through a crack, the eye sees land behind land
        return Goal(*first, hides=hides, has_holes=self.voids == "hole")

    @property
    def tolerance_px(self) -> float:
        """The tolerance of the mesh; 0 for methods that draw every post."""
        return 0.0 if self.method in EVERY_POST or self.max_error_px is None else self.max_error_px


def _is_direction(sun: Any) -> bool:
    """Whether a value is an azimuth and an elevation in degrees."""
    try:
        azimuth, elevation = sun
        return math.isfinite(azimuth) and bool(-90 <= elevation <= 90)
    except (TypeError, ValueError):
        return False


OPTIONS: dict[str, Option] = {each.name: each.metadata["option"] for each in fields(FrameOptions)}
CHOICES = {name: option.choices for name, option in OPTIONS.items() if option.choices}
