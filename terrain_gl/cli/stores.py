"""Commands whose map may be a store: their options, a progress bar while tiles come, and the exit status.

A large raster is drawn from a store, too, which is made at first use (`store.cache`).
"""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import asdict
from typing import Any

from ..basics.exceptions import TerrainError, UsageError
from ..basics.limits import is_too_large
from ..files.edits import read_edits
from ..files.maps import BundledMap, open_map, posts_of, sample
from ..heightmap import Heightmap
from ..pages.edited_map import EditedMap
from ..pages.map import PagedMap
from ..readers import open_raster
from ..renderer import Renderer
from ..renderer.options import FrameOptions
from ..store import StoredMap, cache, is_store
from . import options, report, values
from .records import DrawOptions, MapOptions, StoreOptions


def add_options(command: options.Options) -> None:
    """Add the options of commands whose map may be a store."""
    group = command.add_argument_group("store")
    what = "of a store: MiB of GPU memory for tiles (default: 512)"
    group.add_argument("--gpu-memory", type=values.count, metavar="MIB", default=512, help=what)
    what = "of a store: MiB of memory for tiles (default: 512)"
    group.add_argument("--memory", type=values.count, metavar="MIB", default=512, help=what)
    what = "edits of a store to draw, .tif or .npz"
    group.add_argument("--edits", metavar="FILE", help=what)
    what = "hold a large raster in memory, keep no store"
    group.add_argument("--no-cache", action="store_true", help=what)


def opened(asked: DrawOptions, progress: Callable[[float], None] | None = None) -> tuple[Heightmap, BundledMap | None]:
    """The map of a command, and its `BundledMap`, if it is one; a large raster's store is made at its first use.

    `progress` is called with the progress; without it, a bar shows that of a build.
    """
    if is_store(asked.map.name):
        return _given(asked), None
    check_no_edits(asked)
    may_pay = not asked.store.no_cache and os.path.isfile(asked.map.name)
    raster = open_raster(asked.map.name, asked.map.reading) if may_pay else None
    stored = _of_raster(asked, raster.shape[:2], progress) if raster else None
    heightmap, known = (stored, None) if stored else open_map(*asked.map.source, progress, raster)
    report.notes_of(heightmap)
    return heightmap, known


def open_posts(asked: MapOptions) -> Heightmap:
    """A map for a command that reads its posts and draws nothing: a store, or a file in memory."""
    heightmap = store_of(asked) if is_store(asked.name) else open_map(*asked.source)[0]
    report.notes_of(heightmap)
    return heightmap


def store_of(asked: MapOptions) -> StoredMap:
    """A store that a command names. `UsageError` if options say how to read it."""
    if asked != MapOptions(name=asked.name):
        raise UsageError(
            f"{report.shown(asked.name)}: is a store, which has its own scales: to change them, build it again"
        )
    return StoredMap(asked.name)


def _given(asked: DrawOptions) -> PagedMap:
    """A store that the command names."""
    name = report.shown(asked.map.name)
    if not asked.store.gpu_memory:
        raise TerrainError(f"{name}: is a store: shot, measure, mesh, tiles, check, fly, view and info read stores")
    stored = _limited(store_of(asked.map), asked.store)
    if asked.store.edits is None:
        return stored
    edited = EditedMap(stored)
    for x, y, heights in read_edits(asked.store.edits, stored):
        edited.write(x, y, heights)
    edited.saved_as = asked.store.edits
    return edited


def _of_raster(
    asked: DrawOptions, posts: tuple[int, int], show: Callable[[float], None] | None = None
) -> StoredMap | None:
    """The store of a large raster, made at first use; None if the raster is to be held in memory."""
    if not _pays(posts):
        return None
    name, reading, spacing_m = asked.map.source
    rows, cols = posts
    fits = not is_too_large(rows, cols)
    size = f"{report.shown(name)}: {cols:,} x {rows:,} posts"
    lacks = _lacks(asked.frame)
    if lacks and fits:
        report.note(f"{size} in memory, because of {lacks}")
        return None
    try:
        is_there = cache.has(*asked.map.source)
        where = f"in {cache.folder()}; --no-cache holds it in memory" if fits else f"in {cache.folder()}"
        report.note(f"{size}, drawn from a store {'' if is_there else 'that is made once, '}{where}")
        with report.progress_bar("building") if show is None else nullcontext(show) as progress:
            stored = cache.stored(*asked.map.source, progress)
    except TerrainError as error:
        if not fits:
            raise
        report.note(f"{error}; {report.shown(name)} is held in memory instead")
        return None
    stored.opened = {"path": name, "spacing_m": spacing_m} | asdict(reading)
    return _limited(stored, asked.store)


def _limited(stored: StoredMap, limits: StoreOptions) -> StoredMap:
    stored.limit(limits.gpu_memory << 20, limits.memory << 20)
    return stored


def sample_meanwhile(asked: DrawOptions) -> Heightmap | None:
    """A coarse sample of a raster, to show while its store is made; None if no store must be made."""
    if asked.store.no_cache or not os.path.isfile(asked.map.name):
        return None
    pays = _pays(posts_of(asked.map.name, asked.map.reading))
    if not pays or _lacks(asked.frame) or not cache.is_possible() or cache.has(*asked.map.source):
        return None
    try:
        return sample(*asked.map.source)[0]
    except TerrainError:  # GDAL cannot read parts of the raster
        return None


def _pays(posts: tuple[int, int]) -> bool:
    """Whether a store of a raster of so many posts saves time, or is needed."""
    rows, cols = posts
    return rows * cols >= cache.PAYS_POSTS or is_too_large(rows, cols)


def may_be_held(heightmap: Heightmap) -> bool:
    """Whether a map is the store of a raster that could also be held in memory."""
    return heightmap.is_store and heightmap.opened is not None and not is_too_large(heightmap.rows, heightmap.cols)


def _lacks(frame: FrameOptions) -> str:
    """An option that was given and that stores do not have; "" if there is none."""
    if frame.method != "sat":
        return f"--method {frame.method}"
    return "--style error" if frame.style == "error" else ""


def check_no_edits(asked: DrawOptions) -> None:
    """Refuse --edits for a map that is no store."""
    if asked.store.edits is not None:
        raise UsageError(f"--edits: edits are for a store, and {report.shown(asked.map.name)} is none")


def rebuild(renderer: Renderer) -> None:
    """Compute the records of edited nodes anew. If that fails, say so; the wide bounds still hold."""
    if renderer.streaming is None or not isinstance(renderer.heightmap, EditedMap):
        return
    try:
        with report.progress_bar("measuring edits") as progress:
            renderer.rebuild(progress)
    except TerrainError as error:
        report.note(str(error))


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
    """The exit status of a drawn frame. If tiles of a store are missing, it is 1, and a line says why."""
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
