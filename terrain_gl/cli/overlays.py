"""`--overlay`: lines, points and pictures over the land."""

from __future__ import annotations

import argparse
import os
from typing import Any

from ..exceptions import UsageError
from ..heightmap import Heightmap
from ..overlay import Overlay, read_overlay
from ..store import StoredMap

PICTURES = (".tif", ".tiff", ".png", ".jpg", ".jpeg", ".jp2", ".webp", ".exr", ".vrt")


def add(command: Any) -> None:
    """What is laid over the land."""
    what = "over the land, by its coordinates: lines and points, GeoJSON; or a picture of the ground. May be repeated"
    command.add_argument("--overlay", metavar="FILE", action="append", default=[], help=what)


def lay_pictures(args: argparse.Namespace) -> None:
    """Take a picture among the overlays for the picture of the ground.

    Raises
    ------
    UsageError
        There are several, or a `--material`, too.
    """
    pictures = [path for path in args.overlay if os.path.splitext(path)[1].lower() in PICTURES]
    if len(pictures) + (args.material is not None) > 1:
        raise UsageError("--overlay: one picture of the ground at most, and not beside --material")
    args.overlay = [path for path in args.overlay if path not in pictures]
    args.material = pictures[0] if pictures else args.material


def of(args: argparse.Namespace, heightmap: Heightmap) -> tuple[Overlay, ...]:
    """The lines and points of `--overlay`.

    Raises
    ------
    TerrainError
        A file that holds none, or coordinates that cannot be brought to the map.
    UsageError
        The map is a store.
    """
    if args.overlay and isinstance(heightmap, StoredMap):
        raise UsageError("--overlay: lines and points cannot be laid over a store yet")
    return tuple(read_overlay(path, heightmap) for path in args.overlay)
