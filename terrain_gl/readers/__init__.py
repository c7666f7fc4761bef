"""Readers: they give a raster file as blocks of raw pixel values, so that a large map is never in memory twice.

The first bytes of a file decide its kind, not its name. Only .hgt, .raw, .r16 and .r32 files, which have no header,
are recognised by their names. OpenImageIO reads PNG, EXR, HDR, PNM, WebP, JPEG XL, SGI and, without rasterio, TIFF.
numpy reads .npy and files without a header. rasterio (GDAL) reads TIFF with its tags, other local rasters, and mosaics
of them (.vrt). Unless the user trusts a file (`Reading.trusted`), opening it reads the file, its headers beside it and,
for a mosaic, its sources beside or below it; nothing else.
"""

import os
import re
from functools import partial

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.basics.inputs import check_input, is_store
from terrain_gl.readers.archives import open_gzip, open_zip
from terrain_gl.readers.arrays import RAW_ENDINGS, open_hgt, open_npy, open_raw
from terrain_gl.readers.gdal import open_gdal
from terrain_gl.readers.images import open_oiio
from terrain_gl.readers.raster import Raster, Spacing, has_rasterio, one_band
from terrain_gl.readers.values import AS_STORED, Reading
from terrain_gl.readers.vrt import VRT, sources_of

__all__ = ["Raster", "Reading", "Spacing", "files_of", "has_windows", "open_raster"]

_ZIP = b"PK\x03\x04"
_GZIP = b"\x1f\x8b"
_PNG = b"\x89PNG\r\n\x1a\n"
_IMAGE = (_PNG, b"\x76\x2f\x31\x01", b"#?RADIANCE", b"#?RGBE")
_OTHERS = re.compile(rb"RIFF....WEBP|\xff\x0a|\0\0\0\x0cJXL |\x01\xda[\0\x01][\x01\x02]", re.DOTALL)  # also SGI
_PNM = re.compile(rb"P[1-6Ff]\s")


def open_raster(path: str | os.PathLike[str], reading: Reading = AS_STORED) -> Raster:
    """Open a raster file by its kind.

    Raises
    ------
    TerrainError
        The file is missing, unreadable, empty, damaged, or of an unknown kind.
    """
    path = os.fspath(path)
    name = os.fsencode(path).decode("utf-8", "replace")
    head = _first_bytes(path)
    if head.startswith(_ZIP):
        return open_zip(path, name, partial(_unpacked, reading=reading))
    if head.startswith(_GZIP):
        return open_gzip(path, name, partial(_unpacked, reading=reading))
    return _one_raster(path, name, head, reading)


def has_windows(path: str | os.PathLike[str], reading: Reading = AS_STORED) -> bool:
    """Whether GDAL reads windows of this file: not of archives, images, .npy, headerless files."""
    path = os.fspath(path)
    head = _first_bytes(path)
    is_packed = head.startswith((_ZIP, _GZIP))
    return not is_packed and _opens_with_gdal(path, head, reading) and has_rasterio()


def _unpacked(path: str, reading: Reading) -> Raster:
    head = _first_bytes(path)
    if head.startswith((_ZIP, _GZIP)):  # some archives contain themselves
        raise TerrainError(f"{path}: is an archive in an archive: unpack it first")
    return _one_raster(path, path, head, reading)


def _one_raster(path: str, name: str, head: bytes, reading: Reading) -> Raster:
    raster = _opened(path, name, head, reading)
    return raster if reading.band is None or raster.bands_chosen else one_band(raster, reading.band)


def files_of(path: str | os.PathLike[str]) -> list[str]:
    """The real paths of all named files that opening a map reads: the file itself, or the sources of a mosaic."""
    path = os.fspath(path)
    try:
        is_vrt = _first_bytes(path).lstrip().startswith(VRT)
        return [os.path.realpath(path), *(sources_of(path, path) if is_vrt else ())]
    except TerrainError:  # opening the map reports the reason
        return [os.path.realpath(path)]


def _first_bytes(path: str) -> bytes:
    """Read the bytes by which the kind of a regular file is recognised."""
    if is_store(path):
        raise TerrainError(f"{path}: is a store, not a file: open it with terrain_gl.store.StoredMap")
    name = check_input(path, "name a heightmap file")
    try:
        with open(path, "rb") as file:
            head = file.read(64)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise TerrainError(f"{name}: cannot be read ({reason}): check its permissions") from None
    if not head:
        raise TerrainError(f"{name}: is empty (0 bytes): download or export it again")
    return head


def _opened(path: str, name: str, head: bytes, reading: Reading) -> Raster:
    ending = os.path.splitext(path)[1].lower()
    if reading.raw or ending in RAW_ENDINGS:
        return open_raw(path, name, reading.raw, reading.byte_order)
    if ending == ".hgt":
        return open_hgt(path, name)
    if head.startswith(b"\x93NUMPY"):
        return open_npy(path, name)
    if not _opens_with_gdal(path, head, reading):
        return open_oiio(path, name)
    return open_gdal(path, name, reading.trusted, reading.band)


def _opens_with_gdal(path: str, head: bytes, reading: Reading) -> bool:
    """Whether GDAL is the only reader for this kind of file."""
    ending = os.path.splitext(path)[1].lower()
    if reading.raw or ending in (*RAW_ENDINGS, ".hgt") or head.startswith(b"\x93NUMPY"):
        return False
    is_tiff = head.startswith((b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"))
    is_image = (
        head.startswith(_IMAGE) or bool(_PNM.match(head) or _OTHERS.match(head)) or (is_tiff and not has_rasterio())
    )
    is_image = is_image and not (head.startswith(_PNG) and has_rasterio() and _has_headers_of_gdal(path))
    return not is_image


def _has_headers_of_gdal(path: str) -> bool:
    """Whether a file has headers of GDAL beside it: with place, scale and no-data value, or with a mask."""
    return any(os.path.isfile(path + ending) for ending in (".aux.xml", ".msk"))
