"""Readers: they give a raster file as blocks of raw pixel values, so that a large map is never in memory twice.

The first bytes of a file decide its kind, not its name. Only .hgt, .raw, .r16 and .r32 files, which have no header,
are recognised by their names. OpenImageIO reads PNG, EXR, HDR, PNM, WebP, JPEG XL, SGI and, without rasterio, TIFF.
numpy reads .npy and files without a header. rasterio (GDAL) reads TIFF with its tags, other local rasters, and mosaics
of them (.vrt). Unless the user trusts a file (`Reading.trusted`), opening it reads the file, its headers beside it and,
for a mosaic, its sources beside or below it; nothing else.
"""

import contextlib
import os
import re
from dataclasses import replace
from functools import partial

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.basics.inputs import check_input
from terrain_gl.readers.archives import encoding_of, open_gzip, open_text, open_zip
from terrain_gl.readers.arrays import RAW_ENDINGS, open_hgt, open_npy, open_raw
from terrain_gl.readers.gdal import open_gdal
from terrain_gl.readers.images import open_oiio
from terrain_gl.readers.local import sources_of
from terrain_gl.readers.raster import Band, Blocks, Raster, Spacing, has_rasterio, number_of
from terrain_gl.readers.refusals import step_for_folder
from terrain_gl.readers.tiles import check_packed, placed_by_name
from terrain_gl.readers.values import AS_STORED, Reading

__all__ = ["Raster", "Reading", "Spacing", "files_of", "open_raster", "state_of"]

_ZIP = b"PK\x03\x04"
_GZIP = b"\x1f\x8b"
_PNG = b"\x89PNG\r\n\x1a\n"
_TIFF = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
_IMAGE = re.compile(  # PNG, EXR, HDR, PNM, WebP, JPEG XL, SGI
    rb"\x89PNG\r\n\x1a\n|v/1\x01|#\?RADIANCE|#\?RGBE|P[1-6Ff]\s|RIFF....WEBP"
    rb"|\xff\x0a|\0\0\0\x0cJXL |\x01\xda[\0\x01][\x01\x02]",
    re.DOTALL,
)


def open_raster(path: str | os.PathLike[str], reading: Reading = AS_STORED) -> Raster:
    """Open a raster file by its kind; `TerrainError` if it is missing, unreadable, damaged, or of an unknown kind."""
    path = os.fspath(path)
    name = os.fsencode(path).decode("utf-8", "replace")
    head = _first_bytes(path)
    if head.startswith(_ZIP):
        return open_zip(path, name, partial(_unpacked, reading=reading))
    if head.startswith(_GZIP):
        return open_gzip(path, name, partial(_unpacked, reading=reading))
    if encoding := encoding_of(path, head):
        return open_text(path, name, encoding, partial(_unpacked, reading=reading))
    return _opened(path, name, head, reading)


def _unpacked(path: str, reading: Reading) -> Raster:
    head = _first_bytes(path)
    if head.startswith((_ZIP, _GZIP)):  # some archives contain themselves
        raise TerrainError(f"{path}: is an archive in an archive: unpack it first")
    if encoding := encoding_of(path, head):
        return open_text(path, path, encoding, partial(_unpacked, reading=reading))
    return _opened(path, path, head, reading)


def files_of(path: str | os.PathLike[str]) -> list[str]:
    """The real paths of all named files that opening a map reads: the file itself, or the sources of a mosaic."""
    found = [os.path.realpath(path)]
    if os.path.isfile(path):
        with contextlib.suppress(TerrainError, OSError):  # opening the map reports the reason
            found += sources_of(os.fspath(path), os.fspath(path))
    return found


def state_of(path: str | os.PathLike[str]) -> list[tuple[str, int, int]]:
    """Real path, size and time of all files that opening a map reads, except sources that are in no file of a disk."""
    found = []
    for name in files_of(path):
        with contextlib.suppress(OSError):  # with --trust, a source may be in an archive, or on the network
            status = os.stat(name)
            found.append((name, status.st_size, status.st_mtime_ns))
    return found


def _first_bytes(path: str) -> bytes:
    """Read the bytes by which the kind of a regular file is recognised."""
    if os.path.isdir(path):
        raise TerrainError(step_for_folder(path, os.fsencode(path).decode("utf-8", "replace")))
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
    if reading.is_packed:
        check_packed(name, head)
    match kind := _kind(path, head, reading):
        case "raw":
            raster = open_raw(path, name, reading.raw, reading.byte_order)
        case "hgt":
            raster = open_hgt(path, name)
        case "npy":
            raster = open_npy(path, name)
        case "image":
            raster = open_oiio(path, name)
        case _:
            raster = open_gdal(path, name, reading.trusted, reading.band)
    raster = placed_by_name(raster, path, reading.is_packed)
    return raster if reading.band is None or kind == "gdal" else _one_band(raster, reading.band)


def _one_band(raster: Raster, band: Band) -> Raster:
    """Keep one channel, by its number or its name, and the opacity; `TerrainError` if there is no such channel."""
    names = raster.bands or ("",) * raster.colours
    kept = number_of(band, names, raster.name) - 1
    keep = [kept, raster.shape[2] - 1] if raster.has_alpha else [kept]

    def blocks() -> Blocks:
        with contextlib.closing(raster.blocks):
            for where, pixels in raster.blocks:
                yield where, pixels[..., keep]

    return replace(raster, shape=(*raster.shape[:2], len(keep)), blocks=blocks(), bands=(names[kept],))


def _kind(path: str, head: bytes, reading: Reading) -> str:
    """Which reader a file needs: "raw", "hgt", "npy", "image" or "gdal"."""
    ending = os.path.splitext(path)[1].lower()
    if reading.raw or ending in RAW_ENDINGS:
        return "raw"
    if ending == ".hgt":
        return "hgt"
    if head.startswith(b"\x93NUMPY"):
        return "npy"
    is_image = _IMAGE.match(head) is not None
    # headers of GDAL beside a PNG: place, scale and no-data value, or a mask
    has_headers = head.startswith(_PNG) and any(os.path.isfile(path + header) for header in (".aux.xml", ".msk"))
    if is_image and not has_headers:
        return "image"  # without a question to rasterio, whose import takes long
    return "image" if (is_image or head.startswith(_TIFF)) and not has_rasterio() else "gdal"
