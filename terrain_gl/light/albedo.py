"""Pictures of the ground: linear albedo, read a few rows at a time, at the resolution that shading uses."""

import os
from contextlib import closing

import numpy as np

from ..basics.exceptions import TerrainError
from ..basics.inputs import check_input
from ..readers.images import open_oiio
from .ramps import Range
from .tones import Tones, range_of, with_opacity

MOST_SIDE = 8192  # texels of the texture that shading samples
MOST_PIXELS = 1 << 29  # most pixels of a file
_SAMPLES = 1024  # pixels a side of the sample in which the highest value is looked for


def read_albedo(path: str | os.PathLike[str], most_side: int = MOST_SIDE, asked: Range | None = None) -> np.ndarray:
    """Linear albedo of a picture, half floats, 0 to 1: (rows, cols, 3), or (rows, cols, 4) as `read_ground` returns it.

    A picture of more than `most_side` pixels a side is reduced: each texel is the mean of a square of pixels.

    Raises
    ------
    TerrainError
        The same errors as `tones_in`, or values that are not finite.
    """
    tones = tones_in(path, asked)
    name = os.fspath(path)
    raster = open_oiio(name, name)
    rows, cols, _ = raster.shape
    n = -(-max(rows, cols) // most_side)
    has_alpha = raster.has_alpha and tones.has_opacity
    channels = 4 if has_alpha else 3
    albedo = np.zeros((-(-rows // n), -(-cols // n), channels), "f4" if n > 1 else "f2")
    with np.errstate(under="ignore"):  # the smallest half float is 6e-8
        for where, pixels in raster.blocks:
            if not np.isfinite(pixels).all():
                raise TerrainError(f"{name}: has values that are not finite: correct the picture")
            colour = tones.linear(pixels[..., : len(tones.bands)])
            if has_alpha:
                share = share_of(pixels[..., -1:])
                colour = np.concatenate([np.broadcast_to(colour * share, (*share.shape[:2], 3)), share], -1)
            if n == 1:
                albedo[where] = colour
            else:
                added_to(albedo, where.start, n, colour)
        return albedo if n == 1 else mean_of(albedo, rows, cols, n)


def tones_in(path: str | os.PathLike[str], asked: Range | None = None) -> Tones:
    """How the values of a picture without coordinates become colours.

    Raises
    ------
    TerrainError
        The file is not a readable picture, or has too many pixels.
    """
    name = check_input(path, "name a picture")
    raster = open_oiio(os.fspath(path), name)
    rows, cols, _ = raster.shape
    if rows * cols > MOST_PIXELS:
        raise TerrainError(f"{name}: has {cols} x {rows} pixels, more than {MOST_PIXELS:,}: reduce the picture")
    bands = (1, 2, 3) if raster.colours >= 3 else (1,)
    values = np.zeros(0, raster.dtype)
    declared = None
    step = max(1, max(rows, cols) // _SAMPLES)
    with closing(raster.blocks):
        if not asked and raster.dtype != np.uint8:
            values = np.concatenate([p[::step, ::step, : len(bands)].ravel() for _, p in raster.blocks])
        elif raster.dtype == np.uint8 and raster.has_alpha and name.lower().endswith((".tif", ".tiff")):
            declared = np.concatenate([p[::step, ::step, -1].ravel() for _, p in raster.blocks])
    found, notes = range_of(values, None, asked)  # OpenImageIO scales 12 bits to 16
    return with_opacity(Tones(bands, found, None, notes), declared)


def share_of(opacity: np.ndarray, most: float | None = None) -> np.ndarray:
    """Opacity from 0 to 1; `most` is opaque, by default the largest number of the type.

    Floats have no common largest value, so every float except 0 counts as opaque.
    """
    if opacity.dtype.kind == "f":
        return (opacity != 0).astype("f4")
    return np.minimum(opacity.astype("f4") / np.float32(most or np.iinfo(opacity.dtype).max), np.float32(1))


def added_to(sums: np.ndarray, first: int, n: int, colour: np.ndarray) -> None:
    """Add rows of pixels, from row `first` on, to the sums over boxes of n × n pixels."""
    across = np.add.reduceat(colour, np.arange(0, colour.shape[1], n), 1)
    np.add.at(sums, (first + np.arange(len(colour))) // n, across)


def mean_of(sums: np.ndarray, rows: int, cols: int, n: int, dtype: str = "f2") -> np.ndarray:
    """Divide by the number of pixels in each square; squares at the far edges have fewer pixels."""
    high, wide = (np.minimum(n, size - np.arange(0, size, n)).astype("f4") for size in (rows, cols))
    return (sums / (high[:, None] * wide)[..., None]).astype(dtype)
