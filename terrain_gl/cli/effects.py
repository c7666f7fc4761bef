"""Notes on requests that a picture cannot show: options without effect, and pictures without land."""

import math
from collections.abc import Iterator

from ..basics.words import UNITS, metres
from ..camera import Camera
from ..files.views import depth_below_ground
from ..heightmap import Heightmap
from ..light.climate import AUTO
from ..light.ramps import AUTO as RAMP_AUTO
from ..light.ramps import LOOKS as RAMPS
from ..renderer.options import NO_SKY
from ..shade.contours import interval_m
from . import report
from .records import CameraOptions, DrawOptions
from .scene import CommandScene

# options of lit styles, and their defaults
_OF_LIGHT = {"sky": None, "haze": 1.0, "material": None, "drape": None, "look": AUTO, "water_m": None}
_TURNED_DEG = 1.0  # a grid that is turned by more gets a note
_NEAR = 5.0  # an eye is near the map if its distance is at most this many longer sides of the map


def tell(asked: DrawOptions, scene: CommandScene) -> None:
    """Print a note for each option that does not change the picture."""
    for text in _without_effect(asked, scene):
        report.note(text)
    frame = scene.frame
    ramp, unit = scene.ramp
    if ramp and frame.drape:
        report.note(f"{report.shown(frame.drape)}: ramp {ramp.name} from {ramp.low:.6g} to {ramp.high:.6g}")
    elif ramp and not frame.ramp_range:
        low_m, high_m = scene.heightmap.range_m
        advice = "; --look diverging is white at 0" if frame.look == "viridis" and low_m < 0 < high_m else ""
        low, high = ramp.low / UNITS[frame.units], ramp.high / UNITS[frame.units]
        report.note(f"--look {frame.look}: from {low:.6g} to {high:.6g} {unit}{advice}")


def _without_effect(asked: DrawOptions, scene: CommandScene) -> Iterator[str]:
    heightmap, frame = scene.heightmap, scene.frame
    is_lit = frame.shading.is_lit
    if abs(north := heightmap.north_deg) > _TURNED_DEG:
        turned = f"{abs(north):.1f} degrees {'clockwise' if north > 0 else 'counter-clockwise'} from the grid's"
        yield f"true north, from which the sun's azimuth counts, is {turned} north"
    if frame.style == "cracks":
        yield "--style cracks: patches do not agree on edges; nothing is certified"
    low_m, high_m = heightmap.range_m
    if not is_lit:
        names = {"water_m": "water"}
        given = [
            f"--{names.get(name, name)}"
            for name, usual in _OF_LIGHT.items()
            if getattr(frame, name) not in (usual, NO_SKY)
        ]
        if given:
            yield f"{', '.join(given)}: without effect in the style {frame.style}"
    elif frame.water_m is not None and frame.water_m <= low_m:
        yield f"--water {frame.water_m:g}: without effect, because the lowest height is {low_m:g} m"
    if is_lit and frame.sun[1] < 0 and not frame.shading.sky:
        yield f"the sun is {-frame.sun[1]:.3g} degrees under the horizon: the picture is of the night"
    if frame.ramp_range and not frame.drape and not frame.material and frame.look not in RAMPS:
        yield "--range: without effect, because there is no ramp: give --drape, --material or a --look that is a ramp"
    if frame.ramp != RAMP_AUTO and not frame.drape:
        yield "--ramp: without effect, because there are no values: give --drape, or --look viridis or diverging"
    if frame.contour_m is not None and not _lines_between(low_m, high_m, frame.contour_m):
        unit_m = UNITS[frame.units]
        every = (frame.contour_m or interval_m(low_m, high_m, frame.units)) / unit_m
        between = f"{low_m / unit_m:g} and {high_m / unit_m:g} {frame.units}"
        yield f"--contours: no line, because no multiple of {every:g} {frame.units} lies between {between}"
    if frame.voids == "hole" and not heightmap.voids:
        yield "--voids hole: without effect, because the map has no voids"
    if frame.exaggeration != 1 and low_m == high_m:
        yield "--exaggeration: without effect, because all heights are equal"
    if frame.refraction and not heightmap.bend_per_m(frame.curvature, frame.refraction):
        yield "--refraction: without effect, because the map is drawn flat: give --curvature on"
    light = asked.light
    if light.longitude is not None and (light.time is None or light.time.tzinfo is None):
        yield "--longitude: without effect, because no --time with a zone is given"


def _lines_between(low_m: float, high_m: float, asked_m: float) -> int:
    """Number of visible contour lines. A line at the highest height is not visible: it is drawn above its height."""
    every = asked_m or interval_m(low_m, high_m)
    return math.ceil(high_m / every) - math.ceil(low_m / every)


def tell_no_land(asked: CameraOptions, scene: CommandScene) -> None:
    """Unless the eye is under the ground: say that no land is in the picture, and how far the map is from the eye."""
    if depth_below_ground(scene.seen, scene.camera) > 0:  # `open_scene` has noted this
        return
    away_m = _away_m(scene.heightmap, *scene.camera.eye[:2])
    where = f"the eye is {metres(away_m)} from the map" if away_m else "the eye is over the map, and looks away from it"
    report.note(f"no land is in the picture: {where}{_advice(asked, scene.heightmap, scene.camera)}")


def _away_m(heightmap: Heightmap, x: float, y: float) -> float:
    """Horizontal distance of a place from the map."""
    east, north = heightmap.extent_m
    return math.hypot(max(-x, 0, x - east), max(-y, 0, y - north))


def _advice(asked: CameraOptions, heightmap: Heightmap, camera: Camera) -> str:
    """Advice on how to name a place: an eye near the map, if X and Y are read as map coordinates, was meant so."""
    east, north = heightmap.extent_m
    place = heightmap.place if asked.coordinates == "metres" else None
    if place and _away_m(heightmap, *place.from_map(*camera.eye[:2])) <= _NEAR * max(east, north):
        return "; for --eye and --target in coordinates of the map, add --coordinates map"
    return f"; --eye and --target count metres from its south-west post, and it reaches to {east:.6g},{north:.6g}"
