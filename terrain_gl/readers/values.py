"""Stored pixels as metres: encodings, marks of voids, scale and offset."""

from __future__ import annotations

import contextlib
from collections.abc import Callable

import numpy as np

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.readers.arrays import SRTM_VOID
from terrain_gl.readers.raster import Raster, listed

_LOSSY = 2  # grey levels by which the colours of a grey may differ after lossy compression


def read_heights(
    raster: Raster,
    scales: tuple[float, float],
    nodata: float | None = None,
    encoding: str = "plain",
    progress: Callable[[float], None] | None = None,
) -> np.ndarray:
    """Read all blocks of a raster: (rows, cols) float32 metres, NaN where void.

    Parameters
    ----------
    scales : (float, float)
        A height is value · scale + offset, in metres.
    nodata : float, optional
        A value that marks voids, in addition to the raster's own. 16-bit signed rasters without a value of their own
        use −32768; NaN says that they have none.
    encoding : str
        One of `ENCODINGS`.
    progress : function, optional
        Called with the progress, 0 to 1.
    """
    heights = np.empty(raster.shape[:2], np.float32)
    done = 0
    with contextlib.closing(raster.blocks) as blocks:
        for where, pixels in blocks:
            heights[where] = heights_of(pixels, raster, scales, nodata, encoding)
            done += heights[where].size
            if progress:
                progress(done / heights.size)
    return heights


def heights_of(
    pixels: np.ndarray,
    raster: Raster,
    scales: tuple[float, float],
    nodata: float | None = None,
    encoding: str = "plain",
) -> np.ndarray:
    """Metres of a block of pixels, (rows, cols, channels), NaN where void; arguments as for `read_heights`."""
    heights = _metres(ENCODINGS[encoding](pixels, raster), _void_marks(raster, nodata), *scales)
    if raster.has_alpha:
        heights[pixels[..., -1] == 0] = np.nan
    return heights


def _void_marks(raster: Raster, nodata: float | None) -> list[float]:
    """The stored values that mean "no data", rounded to the type of the pixels."""
    own = raster.nodata
    refused = nodata is not None and np.isnan(nodata)
    if own is None and not refused and raster.dtype.newbyteorder("=") == np.int16:
        own = SRTM_VOID
    marks = [float(mark) for mark in (own, nodata) if mark is not None]
    with np.errstate(over="ignore"):
        return [float(raster.dtype.type(mark)) if raster.dtype.kind == "f" else mark for mark in marks]


def _metres(values: np.ndarray, marks: list[float], z_scale: float, z_offset_m: float) -> np.ndarray:
    """Scale in float64 and round to float32 once, which keeps centimetres at 8848 m."""
    with np.errstate(all="ignore"):
        heights = (values * z_scale + z_offset_m).astype(np.float32)
    void = ~np.isfinite(heights)
    for mark in marks:
        void |= values == mark
    heights[void] = np.nan
    return heights


def _plain(pixels: np.ndarray, raster: Raster) -> np.ndarray:
    """One channel of values. Several channels count as one if they are equal: grey that is stored as colour.

    Lossy compression of colours leaves bytes that differ by one or two.
    """
    colours = pixels[..., : raster.colours]
    if raster.has_alpha and raster.colours > 1:  # transparent pixels may have any colour
        colours = np.where(pixels[..., -1:] == 0, pixels[..., :1], colours)
    others = colours[..., 1:]
    first = np.broadcast_to(pixels[..., :1], others.shape)
    if raster.dtype == np.uint8:
        is_grey = bool((np.abs(others.astype(np.int16) - first) <= _LOSSY).all())
    else:
        is_grey = np.array_equal(others, first, equal_nan=raster.dtype.kind == "f")
    if not is_grey:
        may_be_packed = raster.colours == 3 and raster.dtype == np.uint8
        packed = "if they pack heights, give --encoding terrarium or mapbox; else " if may_be_packed else ""
        names = raster.bands or ("",) * raster.colours
        raise TerrainError(f"{raster.name}: {listed(names)}: {packed}say which holds the heights, as with --band 1")
    return pixels[..., 0].astype(np.float64)


def _packed(pixels: np.ndarray, raster: Raster) -> np.ndarray:
    """Red, green, blue as one 24-bit integer."""
    if raster.colours != 3 or raster.dtype != np.uint8:
        raise TerrainError(
            f"{raster.name}: has {raster.colours} channels of {raster.dtype}: the encodings terrarium and mapbox are "
            "8-bit RGB, drop --encoding"
        )
    return pixels[..., :3].astype(np.float64) @ [65536.0, 256.0, 1.0]


def _terrarium(pixels: np.ndarray, raster: Raster) -> np.ndarray:
    """Metres = 256 R + G + B/256 − 32768 (Mapzen terrain tiles)."""
    return _packed(pixels, raster) / 256 - 32768


def _mapbox(pixels: np.ndarray, raster: Raster) -> np.ndarray:
    """Metres = (65536 R + 256 G + B) / 10 − 10000 (Mapbox Terrain-RGB)."""
    return _packed(pixels, raster) / 10 - 10000


ENCODINGS = {"plain": _plain, "terrarium": _terrarium, "mapbox": _mapbox}
