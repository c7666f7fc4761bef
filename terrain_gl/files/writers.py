"""Heightmap files, written row by row: 16-bit PNG, float TIFF or EXR. A file appears only when it is complete.

If the place of the map is known and rasterio is installed, a TIFF is a GeoTIFF.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from ..basics.exceptions import TerrainError, UsageError
from ..basics.replacing import make_sure_of_space, replacing
from ..heightmap import Heightmap
from ..image import Rows, writing_rows
from ..readers.georeference import DEGREES, Georeference, flat_crs
from ..readers.local import closed_environment
from ..readers.raster import gdal_failures, has_rasterio, one_line

FORMATS = {".png": "uint16", ".tif": "float", ".tiff": "float", ".exr": "float"}
MOST_STEPS = 65534  # most steps of a 16-bit file: the value after them is for voids
VOID = 65535
BAND_POSTS = 2**20  # posts that are written at once


def write_heightmap(path: str | os.PathLike[str], heightmap: Heightmap) -> dict[str, Any]:
    """Write a map, voids included.

    Parameters
    ----------
    path
        `.tif`, `.tiff`, `.exr`: float32 metres, exact; voids are NaN. `.png`: 16-bit steps of the size that
        `least_step` gives, rounded to the nearest; voids are 65535. A TIFF has the map's coordinate system and grid.

    Returns
    -------
    dict
        Arguments of `Heightmap.open`, besides the path, that give the same map again.

    Raises
    ------
    TerrainError, UsageError
        The file cannot be written, or its name has an unknown ending.
    """
    suffix = format_of(path)
    opening = opening_of(heightmap, suffix)
    rows = max(1, BAND_POSTS // heightmap.cols)
    about = f"heights, read with {as_options(opening)}"
    place = heightmap.georeference if suffix in (".tif", ".tiff") and has_rasterio() else None
    with heightmap_file(path, heightmap.cols, heightmap.rows, about, place) as write:
        for first in range(0, heightmap.rows, rows):
            band = heightmap.heights[first : first + rows]
            write(_steps(band, opening) if FORMATS[suffix] == "uint16" else band)
    return opening


def opening_of(heightmap: Heightmap, suffix: str) -> dict[str, Any]:
    """Arguments of `Heightmap.open` for a file of these heights."""
    spacing = {"spacing_m": heightmap.spacing_m}
    if FORMATS[suffix] == "float":
        return spacing
    low, high = heightmap.range_m
    z_offset_m = float(math.floor(low))
    voids = {"nodata": float(VOID)} if heightmap.voids else {}
    return spacing | {"z_scale": least_step(high - z_offset_m), "z_offset_m": z_offset_m} | voids


def as_options(opening: dict[str, Any]) -> str:
    """The arguments of `opening_of` as options of a command."""
    east, north = opening["spacing_m"]
    words = [f"--spacing {east:.12g}" if east == north else f"--spacing {east:.12g},{north:.12g}"]
    names = {"z_scale": "--z-scale", "z_offset_m": "--z-offset", "nodata": "--nodata"}
    return " ".join(words + [f"{option} {opening[key]:.12g}" for key, option in names.items() if key in opening])


def least_step(relief_m: float, steps: int = MOST_STEPS) -> float:
    """The smallest of 1, 2 and 5 times a power of ten with which `steps` steps cover a relief."""
    least = max(relief_m, 1e-3) / steps
    exponent = math.floor(math.log10(least))
    return next(step for digit in (1, 2, 5, 10) if (step := float(f"{digit}e{exponent}")) >= least)


def format_of(path: str | os.PathLike[str]) -> str:
    """Ending of the file's name, in lower case; `UsageError` if it is none of `FORMATS`."""
    suffix = Path(path).suffix.lower()
    if suffix not in FORMATS:
        raise UsageError(f"{path}: a heightmap's name must end in one of {', '.join(FORMATS)}")
    return suffix


@contextmanager
def heightmap_file(
    path: str | os.PathLike[str], cols: int, rows: int, description: str, place: Georeference | None = None
) -> Iterator[Rows]:
    """Yield a function that writes the next rows of a map, from north to south, in the type of `FORMATS`.

    The file replaces `path` when the block ends without an error. With `place`, it is a GeoTIFF.
    """
    if place:
        with _geotiff(path, place, description) as write:
            yield write
        return
    kind = FORMATS[format_of(path)]
    attributes = {"ImageDescription": description, "compression": "zip"}
    if kind == "float":
        attributes["DateTime"] = "1970:01:01 00:00:00"  # today's date would make equal maps differ
    with writing_rows(path, (cols, rows, 1), kind, attributes) as write:
        yield lambda heights: write(heights[..., None])


@contextmanager
def _geotiff(path: str | os.PathLike[str], place: Georeference, description: str) -> Iterator[Rows]:
    """A float GeoTIFF, written by rasterio."""
    import rasterio

    cols, rows = place.size
    # heights are metres, so we leave out the vertical part of the map's system, which may be in feet
    crs = place.crs if place.crs in (None, DEGREES) else flat_crs(place.crs).to_wkt()
    profile = {"driver": "GTiff", "width": cols, "height": rows, "count": 1, "dtype": "float32"}
    profile |= {"transform": rasterio.Affine(*place.grid), "crs": crs, "nodata": math.nan}
    profile |= {"compress": "deflate", "predictor": 3, "bigtiff": "if_safer"}
    done = 0

    def write(heights: np.ndarray) -> None:
        nonlocal done
        with _failing(path):
            file.write(heights, 1, window=((done, done + len(heights)), (0, cols)))
        done += len(heights)

    with replacing(path) as beside:
        make_sure_of_space(beside, 4 * cols * rows)
        with _failing(path):
            file = rasterio.open(beside, "w", **profile)
            file.update_tags(TIFFTAG_IMAGEDESCRIPTION=description)
        try:
            yield write
        finally:
            with _failing(path):
                file.close()


@contextmanager
def _failing(path: str | os.PathLike[str]) -> Iterator[None]:
    """Turn errors of rasterio into one line."""
    try:
        with closed_environment():
            yield
    except gdal_failures() as error:
        raise TerrainError(f"{path}: cannot write: {one_line(error)}") from None


def _steps(heights: np.ndarray, opening: dict[str, Any]) -> np.ndarray:
    """Heights as 16-bit steps."""
    void = np.isnan(heights)
    steps = np.rint((heights.astype(np.float64) - opening["z_offset_m"]) / opening["z_scale"])
    return np.where(void, VOID, np.where(void, 0, steps)).astype(np.uint16)
