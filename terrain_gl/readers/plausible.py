"""A guess of the scale for files without one, if their values cannot be metres."""

from __future__ import annotations

import math

import numpy as np

from terrain_gl.readers.raster import Raster

HIGHEST_RELIEF_M = 20_000.0  # about the height of Everest above the deepest sea floor
USUAL_RELIEF_M = 3000.0
USUAL_SLOPE = 0.2  # relief over extent
STEEPEST = 0.5  # relief over extent of a whole map
USUAL_SPACING_M = 30.0  # spacing of free maps of the whole Earth
LEAST_SIDE = 256  # posts a side; for smaller maps we do not guess


def plausible_scale(raster: Raster, heights: np.ndarray, extent_m: float) -> tuple[float, tuple[str, ...]]:
    """Scale heights in place if they cannot be metres: whole numbers that fill 16 bits, as game engines write them.

    Parameters
    ----------
    heights : numpy.ndarray, float32, shape (rows, cols)
        The values as they are stored, NaN where void.
    extent_m : float
        The longer side of the map.

    Returns
    -------
    (float, tuple of str)
        Metres per unit, and a note on the choice; 1 and no note if the values may be metres.
    """
    if raster.dtype.newbyteorder("=") != np.uint16 or (raster.scale, raster.offset_m) != (1.0, 0.0):
        return 1.0, ()
    low, high = float(np.fmin.reduce(heights, None)), float(np.fmax.reduce(heights, None))
    if not high - low > HIGHEST_RELIEF_M:
        return 1.0, ()
    scale = _round(min(USUAL_SLOPE * extent_m, USUAL_RELIEF_M) / (high - low))
    np.multiply(heights, scale, out=heights, dtype=np.float64, casting="same_kind")  # rounded once
    cannot = f"values {low:g} to {high:g} over {extent_m / 1000:.3g} km cannot be metres"
    return scale, (f"{cannot}: --z-scale {scale:g} is chosen; give --z-scale and --spacing",)


def plausible_spacing(heights: np.ndarray) -> tuple[float, tuple[str, ...]]:
    """The spacing if none is given: 1 m, or more if the relief is too large for the map's extent.

    Returns
    -------
    (float, tuple of str)
        The spacing, and a note on the choice; 1 and no note if that may be right.
    """
    side = max(heights.shape) - 1
    low, high = float(np.fmin.reduce(heights, None)), float(np.fmax.reduce(heights, None))
    if side < LEAST_SIDE - 1 or not STEEPEST * side < high - low <= HIGHEST_RELIEF_M:
        return 1.0, ()
    spacing_m = USUAL_SPACING_M
    while high - low > STEEPEST * side * spacing_m:
        spacing_m *= 3
    both = f"heights {low:g} to {high:g} m are too steep over {side:,} m"
    return spacing_m, (f"{both}: --spacing {spacing_m:g} is chosen; give --spacing, or --z-scale",)


def _round(value: float) -> float:
    """The largest 1, 2 or 5 times a power of ten that is not above a value."""
    power = 10.0 ** math.floor(math.log10(value))
    return float(f"{max(digit for digit in (1, 2, 5) if digit * power <= value * 1.0001) * power:.12g}")
