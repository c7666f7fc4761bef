"""Readers: a raster file as blocks of raw pixel values, so that a large map never stands in memory twice.

The kind of a file is told by its first bytes, never by its name (.hgt, which has no mark of its own, excepted):
OpenImageIO reads PNG, EXR, HDR and, without rasterio, TIFF; numpy reads .npy and .hgt; rasterio (GDAL) reads
TIFF with its tags and everything else.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Callable

from terrain_gl.exceptions import TerrainError
from terrain_gl.readers.arrays import SRTM_VOID, open_hgt, open_npy
from terrain_gl.readers.gdal import open_gdal
from terrain_gl.readers.images import open_oiio
from terrain_gl.readers.raster import Raster, Spacing, has_rasterio

__all__ = ["SRTM_VOID", "Raster", "Spacing", "open_raster"]


def open_raster(path: str | os.PathLike[str]) -> Raster:
    """Open a raster file by its kind.

    Raises
    ------
    TerrainError
        The file is missing, unreadable, empty, damaged, or of a kind that nothing here reads.
    """
    path = os.fspath(path)
    name = os.fsencode(path).decode("utf-8", "replace")
    return _reader(path, _first_bytes(path, name))(path, name)


def _first_bytes(path: str, name: str) -> bytes:
    """Read the bytes that tell the kind; refuse what is not a regular file, for opening a pipe blocks for ever."""
    try:
        if not stat.S_ISREG(os.stat(path).st_mode):
            raise TerrainError(f"{name}: is not a file but a directory, pipe or device: name a heightmap file")
        with open(path, "rb") as file:
            head = file.read(16)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise TerrainError(f"{name}: cannot be read ({reason}): check its name and permissions") from None
    if not head:
        raise TerrainError(f"{name}: is empty (0 bytes): download or export it again")
    return head


def _reader(path: str, head: bytes) -> Callable[[str, str], Raster]:
    if path.lower().endswith(".hgt"):
        return open_hgt
    if head.startswith(b"\x93NUMPY"):
        return open_npy
    if head.startswith((b"\x89PNG\r\n\x1a\n", b"\x76\x2f\x31\x01", b"#?RADIANCE", b"#?RGBE")):
        return open_oiio
    if head.startswith((b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")) and not has_rasterio():
        return open_oiio
    return open_gdal
