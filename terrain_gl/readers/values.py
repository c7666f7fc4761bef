"""Stored pixels as metres: encodings, marks of voids, scale and offset."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from terrain_gl.basics.exceptions import TerrainError, UsageError
from terrain_gl.readers.arrays import ORDERS, SRTM_VOID
from terrain_gl.readers.raster import Band, Raster, Spacing, listed

_LOSSY = 2  # grey levels by which the colours of a grey may differ after lossy compression


class Packing(NamedTuple):
    """Heights in the channels red, green and blue of 8 bits: metres = weights · (R, G, B) / divisor + offset."""

    divisor: float = 1.0
    offset_m: float = 0.0
    weights: tuple[float, float, float] = (65536.0, 256.0, 1.0)
    is_signed: bool = False  # whether red is a signed number
    void: tuple[int, int, int] | None = None  # the colour of posts without a height


_PACKED = {
    "terrarium": Packing(256, -32768),  # Mapzen
    "mapbox": Packing(10, -10000),  # Terrain-RGB
    "gsi": Packing(100, is_signed=True, void=(128, 0, 0)),  # of Japan
}
ENCODINGS = ("plain", *_PACKED, "custom:R,G,B,OFFSET")


def packing_of(encoding: str) -> Packing | None:
    """The packing with this name, or custom:R,G,B,OFFSET with four numbers; None for "plain"."""
    if encoding == "plain" or encoding in _PACKED:
        return _PACKED.get(encoding)
    try:
        red, green, blue, offset_m = map(float, encoding.removeprefix("custom:").split(","))
    except ValueError:
        raise UsageError(f"encoding must be one of {', '.join(ENCODINGS)}, got {encoding!r}") from None
    if not all(map(math.isfinite, (red, green, blue, offset_m))):
        raise UsageError(f"encoding: expected four finite numbers, got {encoding!r}")
    return Packing(1.0, offset_m, (red, green, blue))


@dataclass(frozen=True)
class Reading:
    """How a file is read; `Heightmap.open` describes its arguments."""

    trusted: bool = False
    band: Band | None = None
    raw: tuple[int, int] | None = None
    byte_order: str | None = None
    z_scale: float | None = None
    z_offset_m: float | None = None
    nodata: float | None = None
    encoding: str = "plain"

    def __post_init__(self) -> None:
        if self.z_scale is not None and (not math.isfinite(self.z_scale) or self.z_scale == 0):
            raise UsageError(f"z-scale must be a finite number other than 0, got {self.z_scale}")
        if self.z_offset_m is not None and not math.isfinite(self.z_offset_m):
            raise UsageError(f"z-offset must be a finite number of metres, got {self.z_offset_m}")
        packing_of(self.encoding)  # raises an error for a wrong one
        if isinstance(self.band, int) and self.band < 1:
            raise UsageError(f"bands are counted from 1, got {self.band}")
        if self.byte_order is not None and self.byte_order not in ORDERS:
            raise UsageError(f"byte order must be one of {', '.join(ORDERS)}, got {self.byte_order!r}")

    @property
    def is_told(self) -> bool:
        """Whether the caller has given a scale or an offset of the heights."""
        return self.z_scale is not None or self.z_offset_m is not None

    @property
    def is_packed(self) -> bool:
        """Whether heights are packed in colours."""
        return self.encoding != "plain"

    def unanswered(self, notes: tuple[str, ...], spacing_m: float | Spacing | None) -> tuple[str, ...]:
        """Notes without those that ask for a spacing or a scale that the caller has given."""
        answered = ["--spacing"] * (spacing_m is not None) + ["--z-scale"] * self.is_told
        return tuple(note for note in notes if not any(option in note for option in answered))

    def scales(self, raster: Raster) -> tuple[float, float]:
        """Metres per unit of a raster's values, and the height of value 0."""
        return (
            raster.scale if self.z_scale is None else self.z_scale,
            raster.offset_m if self.z_offset_m is None else self.z_offset_m,
        )


AS_STORED = Reading()


def read_heights(
    raster: Raster, reading: Reading = AS_STORED, progress: Callable[[float], None] | None = None
) -> np.ndarray:
    """Read all blocks of a raster: (rows, cols) float32 metres, NaN where void; `progress` gets 0 to 1."""
    heights = np.empty(raster.shape[:2], np.float32)
    done = 0
    with contextlib.closing(raster.blocks) as blocks:
        for where, pixels in blocks:
            heights[where] = heights_of(pixels, raster, reading)
            done += heights[where].size
            if progress:
                progress(done / heights.size)
    return heights


def heights_of(pixels: np.ndarray, raster: Raster, reading: Reading = AS_STORED) -> np.ndarray:
    """Metres of a block of pixels, (rows, cols, channels), NaN where void."""
    packing = packing_of(reading.encoding)
    values = _unpacked(pixels, raster, packing) if packing else _grey(pixels, raster)
    z_scale, z_offset_m = reading.scales(raster)
    with np.errstate(all="ignore"):  # rounded to float32 once, which keeps centimetres at 8848 m
        heights = (values * z_scale + z_offset_m).astype(np.float32)
    void = ~np.isfinite(heights)
    for mark in _void_marks(raster, reading.nodata):
        void |= values == mark
    if raster.has_alpha:
        void |= pixels[..., -1] == 0
    heights[void] = np.nan
    return heights


def _void_marks(raster: Raster, nodata: float | None) -> list[float]:
    """The stored values that mean "no data", rounded to the type of the pixels.

    16-bit signed rasters without a value of their own use −32768, unless `nodata` is NaN.
    """
    own = raster.nodata
    refused = nodata is not None and np.isnan(nodata)
    if own is None and not refused and raster.dtype.newbyteorder("=") == np.int16:
        own = SRTM_VOID
    marks = [float(mark) for mark in (own, nodata) if mark is not None]
    with np.errstate(over="ignore"):
        return [float(raster.dtype.type(mark)) if raster.dtype.kind == "f" else mark for mark in marks]


def _grey(pixels: np.ndarray, raster: Raster) -> np.ndarray:
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
        packed = "if they pack heights, give --encoding terrarium, mapbox or gsi; else " if may_be_packed else ""
        names = raster.bands or ("",) * raster.colours
        raise TerrainError(f"{raster.name}: {listed(names)}: {packed}say which holds the heights, as with --band 1")
    return pixels[..., 0].astype(np.float64)


def _unpacked(pixels: np.ndarray, raster: Raster, packing: Packing) -> np.ndarray:
    """Heights from the channels red, green and blue; NaN for posts of the colour of voids."""
    if raster.colours != 3 or raster.dtype != np.uint8:
        has = f"has {raster.colours} channels of {raster.dtype}"
        raise TerrainError(f"{raster.name}: {has}: only 8-bit RGB packs heights, drop --encoding")
    colours = pixels[..., :3].astype(np.float64)
    if packing.is_signed:
        colours[..., 0] -= 256.0 * (colours[..., 0] >= 128)
    heights = colours @ np.array(packing.weights) / packing.divisor + packing.offset_m
    if packing.void:
        heights[(pixels[..., :3] == packing.void).all(-1)] = np.nan
    return heights
