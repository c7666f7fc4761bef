"""`--overlay`: lines, points and pictures over the land."""

from __future__ import annotations

import argparse
import os
from typing import Any

from ..basics.exceptions import UsageError
from ..heightmap import Heightmap
from ..renderer.overlay import Overlay, read_overlay

PICTURES = (".tif", ".tiff", ".png", ".jpg", ".jpeg", ".jp2", ".webp", ".exr", ".vrt")


def add(command: Any) -> None:
    """Declare `--overlay`."""
    what = "over the land: lines and points (GeoJSON, GPX, KML, KMZ, TCX), or a picture of the ground; may be repeated"
    command.add_argument("--overlay", metavar="FILE", action="append", default=[], help=what)


def lay_pictures(args: argparse.Namespace) -> None:
    """If an overlay is a picture, use it as the picture of the ground.

    Raises
    ------
    UsageError
        There is more than one picture, `--material` included.
    """
    pictures = [path for path in args.overlay if os.path.splitext(path)[1].lower() in PICTURES]
    if len(pictures) + (args.material is not None) > 1:
        raise UsageError("--overlay: at most one picture of the ground, and not together with --material")
    args.overlay = [path for path in args.overlay if path not in pictures]
    args.material = pictures[0] if pictures else args.material


def of(args: argparse.Namespace, heightmap: Heightmap) -> tuple[Overlay, ...]:
    """The lines and points of `--overlay`.

    Raises
    ------
    TerrainError
        A file has none, or its coordinates cannot be converted to the map's.
    """
    return tuple(read_overlay(path, heightmap) for path in args.overlay)
