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
import OpenImageIO as oiio

from ..basics.exceptions import TerrainError, UsageError
from ..basics.replacing import make_sure_of_space, replacing
from ..heightmap import Heightmap
from ..image import reason_of
from ..readers.gdal import closed_environment
from ..readers.geodesy import flat_crs
from ..readers.georeference import DEGREES, Georeference
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
    UsageError
        An unknown ending.
    TerrainError
        The file cannot be written.
    """
    suffix = format_of(path)
    opening = opening_of(heightmap, suffix)
    rows = max(1, BAND_POSTS // heightmap.cols)
    about = f"heights, read with {as_options(opening)}"
    place = heightmap.georeference if suffix in (".tif", ".tiff") and has_rasterio() else None
    with heightmap_file(path, heightmap.cols, heightmap.rows, about, place) as file:
        for first in range(0, heightmap.rows, rows):
            band = heightmap.heights[first : first + rows]
            file.write(_steps(band, opening) if FORMATS[suffix] == "uint16" else band)
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
) -> Iterator[HeightmapFile | GeoTiff]:
    """Yield a file that takes all rows of a map. It replaces `path` when the block ends without an error.

    Parameters
    ----------
    place
        Where the map lies, for a GeoTIFF.

    Raises
    ------
    TerrainError
        The file cannot be written.
    """
    suffix = format_of(path)
    with replacing(path) as beside:
        make_sure_of_space(beside, cols * rows * (2 if FORMATS[suffix] == "uint16" else 4))
        if place:
            with GeoTiff(beside, path, place, description) as tiff:
                yield tiff
        else:
            with HeightmapFile(beside, path, (cols, rows), FORMATS[suffix], description) as file:
                yield file


class HeightmapFile:
    """A heightmap file, written row by row: `heightmap_file` makes one."""

    def __init__(
        self, beside: Path, path: str | os.PathLike[str], size: tuple[int, int], dtype: str, description: str
    ) -> None:
        self.path = path
        self.row = 0
        spec = oiio.ImageSpec(*size, 1, dtype)
        spec.attribute("ImageDescription", description)
        spec.attribute("compression", "zip")
        if dtype == "float":
            spec.attribute("DateTime", "1970:01:01 00:00:00")  # today's date would make equal maps differ
        self.file: Any = oiio.ImageOutput.create(os.fspath(beside))
        self._ensure(self.file is not None and self.file.open(os.fspath(beside), spec))

    def __enter__(self) -> HeightmapFile:
        return self

    def write(self, rows: np.ndarray) -> None:
        """Add rows below the earlier rows, in the file's own type."""
        end = self.row + len(rows)
        self._ensure(self.file.write_scanlines(self.row, end, 0, rows[..., None]))
        self.row = end

    def __exit__(self, error: Any, *_: object) -> None:
        closed = self.file.close()
        if error is None:
            self._ensure(closed)

    def _ensure(self, done: bool) -> None:
        if not done:
            raise TerrainError(f"{self.path}: cannot write: {reason_of(self.file or oiio)}")


class GeoTiff:
    """A float GeoTIFF, written row by row by rasterio."""

    def __init__(self, beside: Path, path: str | os.PathLike[str], place: Georeference, description: str) -> None:
        import rasterio

        self.path = path
        self.row = 0
        self.cols, rows = place.size
        # heights are metres, so we leave out the vertical part of the map's system, which may be in feet
        crs = place.crs if place.crs in (None, DEGREES) else flat_crs(place.crs).to_wkt()
        profile = {"driver": "GTiff", "width": self.cols, "height": rows, "count": 1, "dtype": "float32"}
        profile |= {"transform": rasterio.Affine(*place.grid), "crs": crs, "nodata": math.nan}
        profile |= {"compress": "deflate", "predictor": 3, "bigtiff": "if_safer"}
        with self._failing():
            self.file = rasterio.open(beside, "w", **profile)
            self.file.update_tags(TIFFTAG_IMAGEDESCRIPTION=description)

    def __enter__(self) -> GeoTiff:
        return self

    def write(self, rows: np.ndarray) -> None:
        """Add rows below the earlier rows."""
        end = self.row + len(rows)
        with self._failing():
            self.file.write(rows, 1, window=((self.row, end), (0, self.cols)))
        self.row = end

    def __exit__(self, *_: object) -> None:
        with self._failing():
            self.file.close()

    @contextmanager
    def _failing(self) -> Iterator[None]:
        try:
            with closed_environment():
                yield
        except gdal_failures() as error:
            raise TerrainError(f"{self.path}: cannot write: {one_line(error)}") from None


def _steps(heights: np.ndarray, opening: dict[str, Any]) -> np.ndarray:
    """Heights as 16-bit steps."""
    void = np.isnan(heights)
    steps = np.rint((heights.astype(np.float64) - opening["z_offset_m"]) / opening["z_scale"])
    return np.where(void, VOID, np.where(void, 0, steps)).astype(np.uint16)
