"""Edits of a store as files: a GeoTIFF, or a patch file for stores whose place is not known.

A GeoTIFF has the smallest rectangle with all edits, on the store's grid; posts without an edit are void. If `build`
reads several files, the last file with a height at a post counts. So the map and this file make the edited store. A
patch file (.npz) has the tiles with edits, and the hash of the store that they belong to. Both kinds can be read again.
"""

import os
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..basics.exceptions import TerrainError, UsageError
from ..basics.rect import Edit
from ..basics.replacing import replacing
from ..heightmap import MAX_HEIGHT_M, Heightmap
from ..pages.edited_map import EditedMap
from ..pages.map import PagedMap
from ..readers.georeference import Georeference
from ..readers.place import check_crs
from ..readers.raster import has_rasterio, one_line
from ..readers.windows import RasterFile, corner_on
from .writers import heightmap_file

PATCH = (".npz",)
WINDOW = (".tif", ".tiff")
_FORMAT = 1
Tiles = dict[tuple[int, int], np.ndarray]


def edits_of(heightmap: Heightmap) -> EditedMap:
    """A map as a store with edits; `UsageError` if the map is no store, or has no edits."""
    if not heightmap.is_store:
        raise UsageError(f"{heightmap.name}: is no store: save the whole map")
    if not isinstance(heightmap, EditedMap) or not heightmap.is_edited:
        raise UsageError(f"{heightmap.name}: has no edits to save")
    return heightmap


def check_edits_name(path: str | os.PathLike[str], heightmap: Heightmap) -> None:
    """Refuse a file name under which edits of this store cannot be saved.

    These are names with an unknown ending; and names of a GeoTIFF, if the store's place is unknown or rasterio is
    missing.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in (*PATCH, *WINDOW):
        raise UsageError(f"{path}: the name of a file of edits must end in {', '.join((*WINDOW, *PATCH))}")
    if suffix in WINDOW and heightmap.georeference is None:
        raise UsageError(f"{path}: the place of {heightmap.name} is not known: save its edits as .npz")
    if suffix in WINDOW and not has_rasterio():
        raise TerrainError(f"{path}: a GeoTIFF needs rasterio (pip install 'terrain-gl[geo]'), or save .npz")


def write_edits(path: str | os.PathLike[str], heightmap: Heightmap) -> None:
    """Write the edits of a store: `.tif` or `.tiff` is a GeoTIFF of float32 metres, `.npz` a patch file.

    Raises
    ------
    TerrainError, UsageError
        There are no edits, the name does not fit (`check_edits_name`), or the file cannot be written.
    """
    edited = edits_of(heightmap)
    check_edits_name(path, edited)
    write_tiles(path, edited, edited.edited())
    edited.saved_as = os.path.abspath(path)


def write_tiles(path: str | os.PathLike[str], heightmap: EditedMap, tiles: Tiles) -> None:
    """Write tiles of edits: see `write_edits`. A thread may do this while the map is edited further."""
    if Path(path).suffix.lower() in WINDOW:
        _write_window(path, heightmap, tiles)
        return
    about = {"format": _FORMAT, "store": heightmap.identity, "shape": (heightmap.rows, heightmap.cols)}
    places = sorted(tiles)
    heights = np.stack([tiles[at] for at in places])
    with replacing(path) as part, open(part, "wb") as file:
        np.savez_compressed(file, tiles=np.array(places), heights=heights, **about)  # type: ignore[arg-type]


def _write_window(path: str | os.PathLike[str], heightmap: EditedMap, tiles: Tiles) -> None:
    side = heightmap.tile
    place = heightmap.georeference
    assert place is not None
    rows, cols = _hull(tiles, side, (heightmap.rows, heightmap.cols))
    grid = place.grid._replace(c=place.grid.c + cols.start * place.grid.a, f=place.grid.f + rows.start * place.grid.e)
    window = Georeference(grid, place.crs, (cols.stop - cols.start, rows.stop - rows.start))
    with heightmap_file(path, *window.size, f"edits of {os.path.basename(heightmap.name)}", window) as write:
        for row in range(rows.start // side, -(-rows.stop // side)):
            first, end = max(rows.start, row * side), min(rows.stop, (row + 1) * side)
            band = np.full((end - first, cols.stop - cols.start), np.nan, np.float32)
            for at, tile in tiles.items():
                if at[0] == row:
                    left, right = max(cols.start, at[1] * side), min(cols.stop, (at[1] + 1) * side)
                    part = tile[first - row * side : end - row * side, left - at[1] * side : right - at[1] * side]
                    band[:, left - cols.start : right - cols.start] = part
            write(band)


def _hull(tiles: Tiles, side: int, shape: tuple[int, int]) -> tuple[slice, slice]:
    """The smallest rectangle with all edits, and with at least two posts along each side."""
    found = []
    for axis in (0, 1):
        places = [at[axis] * side + np.flatnonzero(~np.isnan(tile).all(1 - axis)) for at, tile in tiles.items()]
        posts = np.concatenate(places)
        first, last = min(int(posts.min()), shape[axis] - 2), int(posts.max())
        found.append(slice(first, max(last, first + 1) + 1))
    return found[0], found[1]


def read_edits(path: str | os.PathLike[str], heightmap: Heightmap) -> list[Edit]:
    """Read a file of edits for a store.

    Raises
    ------
    TerrainError, UsageError
        The map is no store; or the file has an unknown ending, cannot be read, or belongs to another store.
    """
    if not heightmap.is_store:
        raise UsageError(f"{path}: edits are for a store, and {heightmap.name} is none")
    check_edits_name(path, heightmap)
    if not os.path.isfile(path):
        raise TerrainError(f"{path}: there is no such file")
    read = _of_window if Path(path).suffix.lower() in WINDOW else _of_tiles
    store: Any = heightmap
    edits = list(read(os.fspath(path), store))
    for edit in edits:  # check all edits before the first is applied
        if (np.abs(edit.heights) > MAX_HEIGHT_M).any():
            raise TerrainError(f"{path}: has heights beyond ±{MAX_HEIGHT_M:g} m")
    return edits


def _of_window(path: str, heightmap: PagedMap) -> Iterator[Edit]:
    """The edits of a GeoTIFF, in bands that are as high as a tile."""
    file = RasterFile(path)
    x, y = corner_on(file, heightmap)
    check_crs(file, heightmap)
    rows, cols = file.shape
    if x < 0 or y < 0 or x + cols > heightmap.cols or y + rows > heightmap.rows:
        raise TerrainError(f"{path}: reaches beyond {heightmap.name}: it belongs to another map")
    for first in range(0, rows, heightmap.tile):
        yield Edit(x, y + first, file.read(slice(first, min(first + heightmap.tile, rows)), slice(0, cols)))


def _of_tiles(path: str, heightmap: PagedMap) -> Iterator[Edit]:
    found = _arrays(path)
    shape = heightmap.rows, heightmap.cols
    if str(found["store"]) != heightmap.identity or found["shape"].tolist() != list(shape):
        raise TerrainError(f"{path}: holds edits of another store than {heightmap.name}")
    side = found["heights"].shape[-1]
    for (row, col), heights in zip(found["tiles"].tolist(), found["heights"], strict=True):
        y, x = row * side, col * side
        if not (0 <= y < shape[0] and 0 <= x < shape[1]):
            raise TerrainError(f"{path}: is damaged: a tile lies beyond the map")
        yield Edit(x, y, heights[: shape[0] - y, : shape[1] - x])


def _arrays(path: str) -> dict[str, Any]:
    """The arrays of a patch file, checked."""
    try:
        if not zipfile.is_zipfile(path):
            raise ValueError("it is no zip archive")
        with np.load(path) as file:
            found = {name: file[name] for name in ("format", "store", "shape", "tiles", "heights")}
        heights = found["heights"]
        tiles = found["tiles"]
        square = heights.ndim == 3 and heights.shape[1] == heights.shape[2]
        fits = tiles.shape == (len(heights), 2) and int(found["format"]) == _FORMAT
        if not (square and fits and heights.dtype == np.float32 and tiles.dtype.kind == "i"):
            raise ValueError("its arrays do not fit together")
    except (OSError, ValueError, KeyError, EOFError, TypeError, zipfile.BadZipFile) as error:
        raise TerrainError(f"{path}: is not a file of edits ({one_line(error)}): save_edits writes one") from None
    return found
