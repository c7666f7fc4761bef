"""`--overlay`: lines, points and pictures over the land."""

from __future__ import annotations

import argparse
import os
from typing import Any

from ..basics.exceptions import TerrainError, UsageError
from ..files.furniture import Stamp, name_stamps
from ..heightmap import Heightmap
from ..light.laid import holds_values, is_albedo, picture_notes
from ..renderer.draped import is_on_map
from ..renderer.names import Label
from ..renderer.overlay import LABEL, Overlay, read_overlay
from . import report

NO_LABELS = "none"
PICTURES = (".tif", ".tiff", ".png", ".jpg", ".jpeg", ".jp2", ".webp", ".exr", ".vrt")


def add(command: Any) -> None:
    """Declare `--overlay` and `--labels`."""
    what = "over the land: GeoJSON, GPX, KML, a picture or values"
    command.add_argument("--overlay", metavar="FILE", action="append", default=[], help=what)
    what = f"property that names points (default: {LABEL}), or none"
    command.add_argument("--labels", metavar="PROPERTY", default=LABEL, help=what)


def lay_pictures(args: argparse.Namespace) -> None:
    """If an overlay is a picture, use it as the picture of the ground. There may be only one, `--material` included."""
    pictures = [path for path in args.overlay if os.path.splitext(path)[1].lower() in PICTURES]
    if len(pictures) + (args.material is not None) + (args.drape is not None) > 1:
        raise UsageError("--overlay: at most one picture of the ground, and not together with --material or --drape")
    args.overlay = [path for path in args.overlay if path not in pictures]
    if pictures and holds_values(pictures[0]):
        args.drape = pictures[0]
    elif pictures:
        args.material = pictures[0]
    elif args.material and holds_values(args.material) and not is_albedo(args.material):
        report.note(f"{report.shown(args.material)}: holds values, not colours: they are shown as by --drape")
        args.drape, args.material = args.material, None
    for note in picture_notes(args.material, args.ramp_range) if args.material else ():
        report.note(f"{report.shown(args.material)}: {note}")


def of(args: argparse.Namespace, heightmap: Heightmap, silent: bool = False) -> tuple[Overlay, ...]:
    """The lines and points of `--overlay`; unless `silent`, a note names each file of which nothing is drawn."""
    laid = tuple(read_overlay(path, heightmap, args.labels) for path in args.overlay)
    if args.labels == NO_LABELS:
        laid = tuple(overlay._replace(names=()) for overlay in laid)
    for path, overlay in zip(args.overlay, laid, strict=True):
        if not silent and not is_on_map(overlay, heightmap):
            has = "lies off the map" if overlay.lines or len(overlay.points) else "has no lines and no points"
            report.note(f"{report.shown(path)}: {has}, so nothing of it is drawn")
    return laid


def names(args: argparse.Namespace, seen: list[Label]) -> list[Stamp]:
    """Names of points to draw over a picture of `args.size`; none, and a note, if there is no font."""
    try:
        return name_stamps(args.size, seen)
    except TerrainError as error:
        report.note(f"no names and no heights of contours: {error}")
        return []


def tell_unseen(args: argparse.Namespace, heightmap: Heightmap, laid: tuple[Overlay, ...], samples: list[int]) -> None:
    """Say which overlays on the map are not in the pictures. `samples` has the number of samples of each overlay."""
    for path, overlay, count in zip(args.overlay, laid, samples, strict=True):
        if not count and is_on_map(overlay, heightmap):
            report.note(f"{report.shown(path)}: nothing of it is in the picture: turn the camera to it")
