"""What lies over the land, and over the picture: lines, points and pictures of `--overlay`; names; `--furniture`."""

from __future__ import annotations

import os
from dataclasses import replace

from ..basics.exceptions import TerrainError, UsageError
from ..basics.words import UNITS
from ..files.furniture import Stamp, name_stamps
from ..heightmap import Heightmap
from ..light.laid import is_albedo, look_into
from ..renderer.draped import is_on_map
from ..renderer.names import Label
from ..renderer.options import FrameOptions
from ..renderer.overlay import LABEL, Overlay, painted, read_overlay
from ..renderer.photos import photo_in
from . import options, report, values
from .records import Drawn, LaidOptions

NO_LABELS = "none"
PICTURES = (".tif", ".tiff", ".png", ".jpg", ".jpeg", ".jp2", ".webp", ".exr", ".vrt")


def add(command: options.Options) -> None:
    """Declare `--overlay`, `--overlay-colour` and `--labels`."""
    what = "over the land: GeoJSON, GPX, KML, a picture or values"
    command.add_argument("--overlay", metavar="FILE", action="append", default=[], help=what)
    what = "of the first --overlay of lines, then of the second, ...: #rrggbb if its file has none, or all:#rrggbb"
    group = options.group_of(command, "picture")
    group.add_argument("--overlay-colour", metavar="COLOUR", action="append", default=[], help=what)
    what = f"property that names points (default: {LABEL}), or none"
    command.add_argument("--labels", metavar="PROPERTY", default=LABEL, help=what)


def add_furniture(command: options.Options) -> None:
    """Declare `--furniture` and `--title`."""
    group = options.group_of(command, "picture")
    what = "draw a title, the north, a scale, and the legend of a ramp"
    group.add_argument("--furniture", action="store_true", help=what)
    group.add_argument("--title", metavar="TEXT", help="of --furniture (default: the map's name)")


def with_ground(asked: Drawn) -> Drawn:
    """The options, with an overlay that is a picture as the picture of the ground: there may be only one."""
    asked = replace(asked, frame=_in_metres(asked.frame))
    frame, laid = asked.frame, asked.laid
    pictures = tuple(path for path in laid.overlay if _is_ground(path))
    grounds = [path for path in (*pictures, frame.material, frame.drape) if path]
    if len(grounds) > 1:
        raise UsageError("--overlay: at most one picture of the ground, and not together with --material or --drape")
    if not grounds or frame.drape:
        return asked
    ground = grounds[0]
    has_values, notes = look_into(ground, frame.ramp_range, is_picture=bool(frame.material))
    has_values = has_values and not (frame.material and is_albedo(ground))
    if has_values and frame.material:
        report.note(f"{report.shown(ground)}: holds values, not colours: they are shown as by --drape")
    for note in () if has_values else notes:
        report.note(f"{report.shown(ground)}: {note}")
    own = {"material": None, "drape": ground} if has_values else {"material": ground}
    lines = replace(laid, overlay=tuple(path for path in laid.overlay if path not in pictures))
    return replace(asked, frame=replace(frame, **own), laid=lines)


def _is_ground(path: str) -> bool:
    """Whether an overlay is a picture of the ground; a photo with a place is not."""
    return os.path.splitext(path)[1].lower() in PICTURES and not photo_in(path)


def _in_metres(frame: FrameOptions) -> FrameOptions:
    """The options with the interval of contour lines in metres; with 40ft, heights are in feet, too."""
    typed = frame.contour_m
    if not isinstance(typed, values.Length):
        return frame
    units = "ft" if typed.unit == "ft" else frame.units
    return replace(frame, contour_m=float(typed) * UNITS[typed.unit or units], units=units)


def of(asked: LaidOptions, heightmap: Heightmap, silent: bool = False) -> tuple[Overlay, ...]:
    """The lines and points of `--overlay`; unless `silent`, a note names each file of which nothing is drawn."""
    laid = tuple(read_overlay(path, heightmap, asked.labels) for path in asked.overlay)
    if asked.labels == NO_LABELS:
        laid = tuple(overlay._replace(names=(), label=NO_LABELS) for overlay in laid)
    colours = asked.overlay_colour
    if len(colours) > len(laid):
        raise UsageError(f"--overlay-colour: {len(colours)} colours for {len(laid)} overlays of lines and points")
    laid = (*map(painted, laid, colours), *laid[len(colours) :])
    for path, overlay in zip(asked.overlay, laid, strict=True):
        if not silent and not is_on_map(overlay, heightmap):
            order = " (GeoJSON has longitudes before latitudes)" if path.lower().endswith("json") else ""
            has = f"lies off the map{order}" if overlay.lines or len(overlay.points) else "has no lines and no points"
            report.note(f"{report.shown(path)}: {has}, so nothing of it is drawn")
    return laid


def names(size: tuple[int, int], seen: list[Label], taken: list[Stamp]) -> list[Stamp]:
    """Names to draw over a picture of a size, beside the stamps `taken`; none, and a note, if there is no font."""
    try:
        return name_stamps(size, seen, taken)
    except TerrainError as error:
        report.note(f"no names and no heights of contours: {error}")
        return []


def tell_unseen(paths: tuple[str, ...], heightmap: Heightmap, laid: tuple[Overlay, ...], samples: list[int]) -> None:
    """Say which overlays on the map are not in the pictures. `samples` has the number of samples of each overlay."""
    for path, overlay, count in zip(paths, laid, samples, strict=True):
        if not count and is_on_map(overlay, heightmap):
            report.note(f"{report.shown(path)}: nothing of it is in the picture: turn the camera to it")
