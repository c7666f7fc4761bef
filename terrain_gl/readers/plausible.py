"""A scale of heights for files that tell none and whose values cannot be metres."""

from __future__ import annotations

import math

import numpy as np

from terrain_gl.readers.raster import Raster

HIGHEST_RELIEF_M = 20_000.0  # more than between Everest and the deepest sea
USUAL_RELIEF_M = 3000.0
USUAL_SLOPE = 0.2  # relief over extent


def plausible_scale(raster: Raster, heights: np.ndarray, extent_m: float) -> tuple[float, tuple[str, ...]]:
    """Scale heights in place where they cannot be metres: whole numbers that fill 16 bits, as game engines write them.

    Parameters
    ----------
    heights : numpy.ndarray, float32, shape (rows, cols)
        The values as they are stored, NaN where void.
    extent_m : float
        The longer side of the map.

    Returns
    -------
    (float, tuple of str)
        Metres per unit, and a line that says what was chosen; 1 and nothing where the values may be metres.
    """
    if raster.dtype.newbyteorder("=") != np.uint16 or (raster.scale, raster.offset_m) != (1.0, 0.0):
        return 1.0, ()
    low, high = float(np.fmin.reduce(heights, None)), float(np.fmax.reduce(heights, None))
    if not high - low > HIGHEST_RELIEF_M:
        return 1.0, ()
    scale = _round(min(USUAL_SLOPE * extent_m, USUAL_RELIEF_M) / (high - low))
    np.multiply(heights, scale, out=heights, dtype=np.float64, casting="same_kind")  # rounded once
    cannot = f"values {low:g} to {high:g} over {extent_m / 1000:.3g} km cannot be metres"
    return scale, (f"{cannot}: --z-scale {scale:g} is chosen; say --z-scale and --spacing",)


def _round(value: float) -> float:
    """The largest 1, 2 or 5 times a power of ten that is not above a value."""
    power = 10.0 ** math.floor(math.log10(value))
    return float(f"{max(digit for digit in (1, 2, 5) if digit * power <= value * 1.0001) * power:.12g}")
