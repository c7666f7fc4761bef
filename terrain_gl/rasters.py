"""Readers: a raster file as blocks of raw pixel values, so that a large map never stands in memory twice.

The kind of a file is told by its first bytes, never by its name (.hgt, which has no mark of its own, excepted):
OpenImageIO reads PNG, EXR, HDR and, without rasterio, TIFF; numpy reads .npy and .hgt; rasterio (GDAL) reads
TIFF with its tags and everything else.
"""

from __future__ import annotations

import contextlib
import math
import os
import re
import stat
import tokenize
import warnings
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import OpenImageIO as oiio

from terrain_gl.exceptions import TerrainError

BLOCK_POSTS = 1 << 20
MAX_CHANNELS = 4
INSTALL_GEO = "pip install 'terrain-gl[geo]'"
SRTM_VOID = -32768.0

Spacing = tuple[float, float]
# Where in the map (an index into rows and columns), and pixels (rows, cols, channels).
Blocks = Generator[tuple[Any, np.ndarray], None, None]


@dataclass
class Raster:
    """A raster file, opened; its pixels come block by block.

    Attributes
    ----------
    name : str
        The file as messages call it.
    shape : tuple of int
        rows, cols, channels.
    dtype : numpy.dtype
        Of the stored pixels.
    blocks : generator of (index, pixels)
        `index` selects rows and columns of the map, `pixels` is (rows, cols, channels). Each comes once.
    has_alpha : bool
        The last channel is opacity.
    nodata : float or None
        The stored value that marks a void, if the file names one.
    spacing_m : (east, north) or None
        Metres between posts, if the file tells.
    """

    name: str
    shape: tuple[int, int, int]
    dtype: np.dtype
    blocks: Blocks
    has_alpha: bool = False
    nodata: float | None = None
    spacing_m: Spacing | None = None

    @property
    def colours(self) -> int:
        """Channels without opacity."""
        return self.shape[2] - self.has_alpha


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
        return _open_hgt
    if head.startswith(b"\x93NUMPY"):
        return _open_npy
    if head.startswith((b"\x89PNG\r\n\x1a\n", b"\x76\x2f\x31\x01", b"#?RADIANCE", b"#?RGBE")):
        return _open_oiio
    if head.startswith((b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")) and not _has_rasterio():
        return _open_oiio
    return _open_gdal


def _rows_at_once(cols: int, unit: int = 1) -> int:
    """Rows of one block: about BLOCK_POSTS posts, whole units (tiles, strips) unless one is larger than that."""
    rows = max(1, BLOCK_POSTS // max(cols, 1))
    return rows if unit > 4 * rows else -(-rows // unit) * unit


# --- OpenImageIO: PNG, EXR, HDR, TIFF ---------------------------------------------------------------------------------


def _open_oiio(path: str, name: str) -> Raster:
    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)  # else heights come back multiplied by their opacity
    with _quiet_stderr():
        image = oiio.ImageInput.open(_utf8(path, name), config)
    if image is None:
        raise _damaged(name, _reason(oiio))
    spec = image.spec()
    if spec.deep or spec.depth > 1 or spec.nchannels > MAX_CHANNELS:
        raise TerrainError(f"{name}: is a deep, volume or many-channel image: keep one channel of heights")
    bits = spec.get_int_attribute("oiio:BitsPerSample", 0)
    if spec.tile_width and bits > 16 and bits != 32:  # seen in OpenImageIO 3.0 to 3.2: memory left as it was, no error
        raise TerrainError(
            f"{name}: is a tiled TIFF of {bits}-bit values, which only GDAL reads rightly: {INSTALL_GEO}"
        )
    shape = (spec.height, spec.width, spec.nchannels)
    has_alpha = spec.nchannels > 1 and spec.alpha_channel == spec.nchannels - 1
    dtype = np.dtype({"uint": "uint32", "int": "int32", "half": "float16"}.get(str(spec.format), str(spec.format)))
    return Raster(name, shape, dtype, _oiio_blocks(image, name), has_alpha)


def _oiio_blocks(image: Any, name: str) -> Blocks:
    spec = image.spec()
    step = spec.tile_height or _rows_at_once(spec.width)
    for row in range(0, spec.height, step):
        rows = slice(row, min(row + step, spec.height))
        top, bottom = spec.y + rows.start, spec.y + rows.stop
        with _quiet_stderr():
            if spec.tile_width:
                columns = (spec.x, spec.x + spec.width)
                pixels = image.read_tiles(0, 0, *columns, top, bottom, 0, 1, 0, spec.nchannels, spec.format)
            else:
                pixels = image.read_scanlines(0, 0, top, bottom, 0, 0, spec.nchannels, spec.format)
        if pixels is None:
            raise _damaged(name, _reason(image))
        yield rows, pixels.reshape(rows.stop - rows.start, spec.width, spec.nchannels)


def _reason(source: Any) -> str:
    """OpenImageIO's last error in one line; after some damaged files its text is not even UTF-8."""
    try:
        text = source.geterror()
    except UnicodeDecodeError:
        text = ""
    return " ".join(text.split())[:120] or "its data do not decode"


def _damaged(name: str, reason: str) -> TerrainError:
    advice = "download or export it again"
    if name.lower().endswith((".tif", ".tiff")) and not _has_rasterio():
        advice += f", or, if it is whole, let GDAL read it: {INSTALL_GEO}"
    return TerrainError(f"{name}: is damaged or cut short ({reason}): {advice}")


@contextlib.contextmanager
def _quiet_stderr() -> Iterator[None]:
    """Silence libpng, which writes lines of its own to file descriptor 2; our one line says the same."""
    saved, null = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(null, 2)
        yield
    finally:
        os.dup2(saved, 2)
        os.close(saved)
        os.close(null)


def _utf8(path: str, name: str) -> str:
    try:
        path.encode("utf-8")
    except UnicodeEncodeError:
        raise TerrainError(f"{name}: its name is not valid UTF-8: rename the file") from None
    return os.path.abspath(path)


# --- numpy: .npy, .hgt ------------------------------------------------------------------------------------------------


def _open_npy(path: str, name: str) -> Raster:
    try:
        array = np.load(path, mmap_mode="r", allow_pickle=False)
    except (ValueError, TypeError, OSError, EOFError, OverflowError, SyntaxError, tokenize.TokenError) as error:
        raise TerrainError(f"{name}: is not a whole .npy array ({_one_line(error)}): save it again") from None
    if array.ndim not in (2, 3) or array.dtype.kind not in "iuf":
        kind = f"{array.ndim}-dimensional {array.dtype}"
        raise TerrainError(f"{name}: holds a {kind} array: expected numbers of shape (rows, cols)")
    shape = (*array.shape, 1)[:3]
    if not array.flags.c_contiguous and array.ndim == 3:
        raise TerrainError(f"{name}: is in Fortran order: save numpy.ascontiguousarray(array)")
    return Raster(
        name, shape, array.dtype, _npy_blocks(path, array.dtype, shape, array.offset, array.flags.c_contiguous)
    )


def _npy_blocks(path: str, dtype: np.dtype, shape: tuple[int, int, int], offset: int, c_order: bool) -> Blocks:
    """Read by pieces, not through the memory map, whose pages would all stay resident."""
    rows, cols, channels = shape if c_order else (shape[1], shape[0], shape[2])
    step = _rows_at_once(cols)
    with open(path, "rb") as file:
        file.seek(offset)
        for row in range(0, rows, step):
            piece = slice(row, min(row + step, rows))
            pixels = np.fromfile(file, dtype, (piece.stop - row) * cols * channels)
            pixels = pixels.reshape(piece.stop - row, cols, channels)
            yield (piece, pixels) if c_order else (np.s_[:, piece], pixels.swapaxes(0, 1))


def _open_hgt(path: str, name: str) -> Raster:
    """SRTM tile: n × n big-endian int16, one degree a side, named after its south-west corner."""
    size = os.path.getsize(path)
    side = math.isqrt(size // 2)
    if size != 2 * side * side:
        raise TerrainError(f"{name}: {size} bytes are not a square of 2-byte posts: the .hgt tile is cut short")
    shape = (side, side, 1)
    blocks = _npy_blocks(path, np.dtype(">i2"), shape, 0, True)
    return Raster(name, shape, np.dtype(">i2"), blocks, nodata=SRTM_VOID, spacing_m=_hgt_spacing(path, side))


def _hgt_spacing(path: str, side: int) -> Spacing | None:
    corner = re.match(r"([NS])(\d\d)[EW]\d\d\d", os.path.basename(path).upper())
    if corner is None or side < 2:
        return None
    latitude = int(corner[2]) * (1 if corner[1] == "N" else -1) + 0.5
    east, north = metres_per_degree(latitude)
    return east / (side - 1), north / (side - 1)


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())[:120]


# --- rasterio: TIFF with its tags, and every other raster that GDAL opens ---------------------------------------------


def _has_rasterio() -> bool:
    try:
        import rasterio  # noqa: F401
    except ImportError:
        return False
    return True


def _open_gdal(path: str, name: str) -> Raster:
    if not _has_rasterio():
        raise TerrainError(
            f"{name}: is not PNG, TIFF, EXR, HDR, NPY or HGT: if it is another kind that GDAL reads, {INSTALL_GEO}"
        )
    import rasterio

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", rasterio.errors.NotGeoreferencedWarning)
            data = rasterio.open(_utf8(path, name))
            _check_bands(data, name)
            spacing_m = _gdal_spacing(data, name)
    except rasterio.errors.RasterioError as error:
        reason = "not a format that GDAL knows" if "not recognized" in str(error) else _one_line(error)
        raise TerrainError(
            f"{name}: is not a readable heightmap ({reason}): give PNG, TIFF, EXR, HDR, NPY, HGT"
        ) from None
    shape = (data.height, data.width, data.count)
    has_alpha = data.count > 1 and data.colorinterp[-1] == rasterio.enums.ColorInterp.alpha
    return Raster(name, shape, np.dtype(data.dtypes[0]), _gdal_blocks(data, name), has_alpha, data.nodata, spacing_m)


def _check_bands(data: Any, name: str) -> None:
    import rasterio

    if data.count == 0:
        raise TerrainError(f"{name}: holds several layers and no raster of its own: extract one with gdal_translate")
    if data.count > MAX_CHANNELS:
        raise TerrainError(f"{name}: has {data.count} bands, not one of heights: extract it with gdal_translate -b")
    if data.dtypes[0].startswith("complex"):
        raise TerrainError(f"{name}: holds complex numbers: convert it to one real height per post")
    if data.colorinterp[0] == rasterio.enums.ColorInterp.palette:
        raise TerrainError(f"{name}: holds palette indices, not heights: convert it to one grey channel")


def _gdal_blocks(data: Any, name: str) -> Blocks:
    import rasterio

    step = _rows_at_once(data.width, unit=data.block_shapes[0][0])
    with data, rasterio.Env(GDAL_CACHEMAX=64):  # MB; the default is a share of the machine's memory
        for row in range(0, data.height, step):
            rows = slice(row, min(row + step, data.height))
            try:
                pixels = data.read(window=((rows.start, rows.stop), (0, data.width)))
            except rasterio.errors.RasterioError as error:
                raise _damaged(name, _one_line(error.__cause__ or error)) from None
            yield rows, np.moveaxis(pixels, 0, -1)


def _gdal_spacing(data: Any, name: str) -> Spacing | None:
    """Metres between posts from the geotransform: degrees at the map's middle latitude, else linear units."""
    grid = data.transform
    if grid.is_identity:
        return None
    if grid.b or grid.d or grid.a < 0 or grid.e > 0:
        raise TerrainError(f"{name}: is not stored north up: turn it first with gdalwarp {name} north-up.tif")
    if data.crs is None:
        return grid.a, -grid.e
    if data.crs.is_geographic:
        east, north = metres_per_degree(grid.f + grid.e * data.height / 2, *_ellipsoid(data.crs))
        return grid.a * east, -grid.e * north
    unit = data.crs.linear_units_factor[1]
    return grid.a * unit, -grid.e * unit


def _ellipsoid(crs: Any) -> tuple[float, float]:
    """Semi-major axis in metres and inverse flattening (0 for a sphere): not every map is of the Earth."""
    found = re.search(r'SPHEROID\["[^"]*",([\d.]+),([\d.]+)', crs.to_wkt(version="WKT1_GDAL"))
    return (float(found[1]), float(found[2])) if found else WGS84


WGS84 = (6378137.0, 298.257223563)


def metres_per_degree(latitude: float, semi_major_m: float = WGS84[0], inverse_flattening: float = WGS84[1]) -> Spacing:
    """Length of one degree east and one degree north on an ellipsoid, in metres.

    N cos φ and M in radians' worth, with the radii of curvature N = a / √(1 − e² sin² φ) of the prime vertical
    and M = a (1 − e²) / (1 − e² sin² φ)^{3/2} of the meridian (Snyder 1987, Map Projections, eqs. 4-19 to 4-21).
    """
    flattening = 1 / inverse_flattening if inverse_flattening else 0.0
    e2 = flattening * (2 - flattening)
    phi = math.radians(latitude)
    w2 = 1 - e2 * math.sin(phi) ** 2
    east = semi_major_m / math.sqrt(w2) * math.cos(phi)
    north = semi_major_m * (1 - e2) / w2**1.5
    return math.radians(east), math.radians(north)
