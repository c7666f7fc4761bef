"""Commands whose map may be a store: their options, a progress bar while tiles come, and the exit status."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from ..basics.exceptions import TerrainError, UsageError
from ..files.edits import read_edits
from ..pages.edited_map import EditedMap
from ..pages.map import PagedMap
from ..renderer import Renderer
from ..store import StoredMap
from . import report, values


def add_options(command: Any) -> None:
    """Options of commands whose map may be a store."""
    group = command.add_argument_group("store")
    what = "of a store: MiB of GPU memory for tiles (default: 512)"
    group.add_argument("--gpu-memory", type=values.count, metavar="MIB", default=512, help=what)
    what = "of a store: MiB of memory for tiles (default: 512)"
    group.add_argument("--memory", type=values.count, metavar="MIB", default=512, help=what)
    what = "edits of a store to draw, .tif or .npz"
    group.add_argument("--edits", metavar="FILE", help=what)


def opened(args: argparse.Namespace, name: str, of_map: dict[str, Any]) -> PagedMap:
    """The store of that name, for a command that can draw it; `of_map`: options for a map's values.

    Raises
    ------
    TerrainError
        The command cannot draw stores, or the store is not finished.
    UsageError
        Options for a map's values were given, which a store does not take.
    """
    if not hasattr(args, "gpu_memory"):
        raise TerrainError(f"{report.shown(name)}: is a store: shot, measure, mesh, fly, view and info read stores")
    if any(value not in (None, False, "plain") for value in of_map.values()):
        raise UsageError(f"{report.shown(name)}: is a store, which has its own scales: to change them, build it again")
    stored = StoredMap(name)
    stored.limit(args.gpu_memory << 20, args.memory << 20)
    if args.edits is None:
        return stored
    edited = EditedMap(stored)
    for x, y, heights in read_edits(args.edits, stored):
        edited.write(x, y, heights)
    edited.saved_as = args.edits
    return edited


def check_no_edits(args: argparse.Namespace, name: str) -> None:
    """Refuse --edits for a map that is no store."""
    if getattr(args, "edits", None) is not None:
        raise UsageError(f"--edits: edits are for a store, and {report.shown(name)} is none")


def rebuild(renderer: Renderer) -> None:
    """Compute the records of edited nodes anew; if that fails, say so: wide bounds hold, too."""
    if renderer.streaming is None or not isinstance(renderer.heightmap, EditedMap):
        return
    try:
        with report.progress_bar("measuring edits") as progress:
            renderer.rebuild(progress)
    except TerrainError as error:
        print(f"terrain-gl: note: {error}", file=sys.stderr)


@contextmanager
def loading(renderer: Renderer) -> Iterator[None]:
    """Show a progress bar while a picture waits for tiles of a store."""
    if renderer.streaming is None:
        yield
        return
    with report.progress_bar("loading") as renderer.streaming.progress:
        yield
    renderer.streaming.progress = None


def status_of(stats: dict[str, Any]) -> int:
    """The exit status of a drawn frame: 1, and a line that says why, if tiles of a store are missing."""
    if stats.get("complete", True):
        return 0
    tiles = stats["tiles_missing"]
    unit = "px" if "certified_max_error_px" in stats else "m"
    error = f"{stats[f'certified_max_error_{unit}']:.3g} {unit}"
    print(
        f"terrain-gl: {report.shown(stats['map'])}: not complete: {len(tiles)} tiles are missing, the error is at most "
        f"{error}; {tiles[0]['tile']}: {tiles[0]['reason']}",
        file=sys.stderr,
    )
    return 1
