"""A guess of the scale if values cannot be metres, and of the spacing if a file has none."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from terrain_gl.readers.raster import Raster, Spacing
from terrain_gl.readers.units import EARTH_M

HIGHEST_RELIEF_M = 20_000.0  # about the height of Everest above the deepest sea floor
USUAL_RELIEF_M = 3000.0
USUAL_RELIEF = 0.2  # relief over extent
USUAL_SLOPE = 0.4  # slope that a tenth of the land exceeds; 0.28 to 0.62 on seven real maps
BOLD_SLOPE = 0.8  # slope that a tenth of the land exceeds in maps of games
STEEPEST_RELIEF = 0.5  # largest plausible relief over extent
STEEPEST_SLOPE = 3.0  # largest plausible slope that a tenth of the land exceeds
SPACINGS_M = (10.0, 30.0, 90.0, 270.0, 810.0)  # spacings to choose from; free maps of the Earth have 30 and 90 m
LEAST_SIDE = 256  # posts a side; for smaller maps we do not guess
_SAMPLES = 1024  # places a side where the slope is measured


class Guess(NamedTuple):
    """Metres per unit of value, metres between posts, and notes for the user on what was guessed."""

    scale: float
    spacing_m: Spacing
    notes: tuple[str, ...]


class Sample(NamedTuple):
    """Heights from which a guess is made."""

    shape: tuple[int, int]  # rows and columns of the map
    low: float  # of all posts
    high: float
    here: np.ndarray  # posts spread over the map, and their neighbours; NaN where void
    east: np.ndarray
    south: np.ndarray


def sample_of(read: Callable[[slice, slice], np.ndarray], shape: tuple[int, int], strip: int) -> Sample:
    """Sample a map that is read in blocks of `strip` rows."""
    rows, cols = shape
    step = max(1, -(-max(shape) // _SAMPLES))
    across = slice(0, cols - 1, step)
    down = np.arange(0, rows - 1, step)
    lows: list[float] = []
    highs: list[float] = []
    found: list[tuple[np.ndarray, ...]] = []
    for first in range(0, rows, strip):
        part = read(slice(first, min(first + strip + 1, rows)), slice(0, cols))
        lows.append(float(np.fmin.reduce(part, None)))
        highs.append(float(np.fmax.reduce(part, None)))
        mine = down[(down >= first) & (down < first + strip)] - first
        found.append((part[mine][:, across], part[mine, 1:][:, across], part[mine + 1][:, across]))
    ends = float(np.fmin.reduce(lows)), float(np.fmax.reduce(highs))
    return Sample(shape, *ends, *(np.concatenate(each) for each in zip(*found, strict=True)))


def guess(raster: Raster, sample: Callable[[], Sample], spacing_m: Spacing | None) -> Guess:
    """Guess the scale of a file that gives none, and the spacing if it is None.

    Parameters
    ----------
    sample
        Function that samples the stored values. It is called only if a guess may be needed.
    """
    known = Guess(1.0, spacing_m or (1.0, 1.0), ())
    is_bare = raster.dtype.newbyteorder("=") == np.uint16 and (raster.scale, raster.offset_m) == (1.0, 0.0)
    if not is_bare and spacing_m:
        return known
    seen = sample()
    if is_bare and seen.high - seen.low > HIGHEST_RELIEF_M:
        return _plausible_scale(seen, known.spacing_m)
    return known if spacing_m else plausible_spacing(seen)


def _plausible_scale(sample: Sample, spacing_m: Spacing) -> Guess:
    """A scale for 16-bit values that cannot be metres.

    The relief becomes a fifth of the longer side, at most 3000 m, and less if a tenth of the land would be steeper than
    `BOLD_SLOPE`.
    """
    low, high = sample.low, sample.high
    extent_m = max((n - 1) * step for n, step in zip(sample.shape, spacing_m[::-1], strict=True))
    scale = min(USUAL_RELIEF * extent_m, USUAL_RELIEF_M) / (high - low)
    steep = _steep_slope(sample, spacing_m)
    scale = _one_digit(min(scale, BOLD_SLOPE / steep) if steep > 0 else scale)
    cannot = f"values {low:g} to {high:g} over {extent_m / 1000:.3g} km cannot be metres"
    return Guess(scale, spacing_m, (f"{cannot}: --z-scale {scale:g} is chosen; give --z-scale and --spacing",))


def plausible_spacing(sample: Sample) -> Guess:
    """The spacing if none is given: 1 m, or more if the land would be too steep with 1 m."""
    one_metre = Guess(1.0, (1.0, 1.0), ())
    side = max(sample.shape) - 1
    low, high = sample.low, sample.high
    if side < LEAST_SIDE - 1 or not 0 < high - low <= HIGHEST_RELIEF_M:
        return one_metre
    steep = _steep_slope(sample, (1.0, 1.0))
    if high - low <= STEEPEST_RELIEF * side and steep <= STEEPEST_SLOPE:
        return one_metre
    usual_m = max(steep / USUAL_SLOPE, SPACINGS_M[0])
    nearest = min(SPACINGS_M, key=lambda choice: abs(math.log(choice / usual_m)))
    enough = [m for m in SPACINGS_M if m >= nearest and high - low <= STEEPEST_RELIEF * side * m]
    spacing_m = min(enough, default=SPACINGS_M[-1])
    if high - low > STEEPEST_RELIEF * side:
        cannot = f"heights {low:g} to {high:g} m are too steep over {side:,} m"
    else:
        degrees = math.degrees(math.atan(steep))
        cannot = f"posts 1 m apart would make a tenth of the land steeper than {degrees:.0f} degrees"
    note = f"{cannot}: --spacing {spacing_m:g} is chosen; give --spacing, or --z-scale"
    return Guess(1.0, (spacing_m, spacing_m), (note,))


def not_of_the_earth(range_m: tuple[float, float]) -> tuple[str, ...]:
    """A note if no land on the Earth has such heights: then we do not know what grows there."""
    if EARTH_M[0] <= range_m[0] and range_m[1] <= EARTH_M[1]:
        return ()
    heights = f"no land on the Earth has heights {range_m[0]:g} to {range_m[1]:g} m"
    return (f"{heights}: drawn in grey, without air; give --z-scale, or --look",)


def _steep_slope(sample: Sample, spacing_m: Spacing) -> float:
    """The slope that a tenth of the land exceeds, from one post to the next; 0 for land that is void or flat."""
    with np.errstate(invalid="ignore"):
        east = (sample.east - sample.here) / spacing_m[0]
        south = (sample.south - sample.here) / spacing_m[1]
        slopes = np.hypot(east, south)
    known = slopes[np.isfinite(slopes)]
    return float(np.percentile(known, 90)) if known.size else 0.0


def _one_digit(value: float) -> float:
    """The largest number of one digit (times a power of ten) that is not above a value."""
    power = 10.0 ** math.floor(math.log10(value))
    return float(f"{math.floor(value / power * 1.0001) * power:.12g}")
