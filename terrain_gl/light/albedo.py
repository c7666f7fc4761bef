"""Pictures of the ground: linear albedo, read a few rows at a time, at the resolution that shading uses."""

import os

import numpy as np

from ..basics.exceptions import TerrainError
from ..basics.inputs import check_input
from ..image import linear_from_srgb
from ..readers.images import open_oiio

MOST_SIDE = 8192  # texels of the texture that shading samples
MOST_PIXELS = 1 << 29  # most pixels of a file
_SRGB_8 = linear_from_srgb(np.arange(256)).astype("f4")


def read_albedo(path: str | os.PathLike[str], most_side: int = MOST_SIDE) -> np.ndarray:
    """Linear albedo of a picture, (rows, cols, 3) half floats, 0 to 1. Integers are read as sRGB, floats as linear.

    A picture of more than `most_side` pixels a side is reduced: each texel is the mean of a square of pixels.

    Raises
    ------
    TerrainError
        The file is not a readable picture, has too many pixels, or has values that are not finite.
    """
    name = check_input(path, "name a picture")
    raster = open_oiio(os.fspath(path), name)
    rows, cols, _ = raster.shape
    if rows * cols > MOST_PIXELS:
        raise TerrainError(f"{name}: has {cols} x {rows} pixels, more than {MOST_PIXELS:,}: reduce the picture")
    n = -(-max(rows, cols) // most_side)
    albedo = np.zeros((-(-rows // n), -(-cols // n), 3), "f4" if n > 1 else "f2")
    with np.errstate(under="ignore"):  # the smallest half float is 6e-8
        for where, pixels in raster.blocks:
            colour = linear_albedo(pixels[..., : 3 if raster.colours >= 3 else 1], name)
            if n == 1:
                albedo[where] = colour
            else:
                added_to(albedo, where.start, n, colour)
        return albedo if n == 1 else mean_of(albedo, rows, cols, n)


def linear_albedo(pixels: np.ndarray, name: str) -> np.ndarray:
    """(rows, cols, 1 or 3) float32 albedo, 0 to 1."""
    if pixels.dtype == np.uint8:
        return _SRGB_8[pixels]
    if pixels.dtype.kind == "u":
        return linear_from_srgb(pixels * (255 / np.iinfo(pixels.dtype).max)).astype("f4")
    if not np.isfinite(pixels).all():
        raise TerrainError(f"{name}: has values that are not finite: correct the picture")
    return np.clip(pixels, 0, 1).astype("f4")


def added_to(sums: np.ndarray, first: int, n: int, colour: np.ndarray) -> None:
    """Add rows of pixels, from row `first` on, to the sums over boxes of n × n pixels."""
    across = np.add.reduceat(colour, np.arange(0, colour.shape[1], n), 1)
    np.add.at(sums, (first + np.arange(len(colour))) // n, across)


def mean_of(sums: np.ndarray, rows: int, cols: int, n: int, dtype: str = "f2") -> np.ndarray:
    """Divide by the number of pixels in each square; squares at the far edges have fewer pixels."""
    high, wide = (np.minimum(n, size - np.arange(0, size, n)).astype("f4") for size in (rows, cols))
    return (sums / (high[:, None] * wide)[..., None]).astype(dtype)
