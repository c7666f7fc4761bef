"""A guess of the scale if values cannot be metres, and of the spacing if a file has none."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from terrain_gl.readers.raster import Raster, Spacing

HIGHEST_RELIEF_M = 20_000.0  # about the height of Everest above the deepest sea floor
EARTH_M = -11_000.0, 8_900.0  # heights of the deepest sea floor and of Everest
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
    """Scale and spacing that are chosen if a file does not give them.

    Attributes
    ----------
    scale
        Metres per unit of value; 1 if the values may be metres.
    spacing_m
        Metres between posts.
    notes
        Notes for the user on the choices.
    """

    scale: float
    spacing_m: Spacing
    notes: tuple[str, ...]


class Sample(NamedTuple):
    """Heights from which a guess is made.

    Attributes
    ----------
    shape
        Rows and columns of the map.
    low, high
        Lowest and highest height of all posts.
    here, east, south
        Heights of posts spread over the map, and of their neighbours; NaN where void.
    """

    shape: tuple[int, int]
    low: float
    high: float
    here: np.ndarray
    east: np.ndarray
    south: np.ndarray


def sample_of(read: Callable[[slice, slice], np.ndarray], shape: tuple[int, int], strip: int) -> Sample:
    """Sample a map that is read in blocks of `strip` rows. The result does not depend on `strip`."""
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
    known_m = spacing_m or (1.0, 1.0)
    scale = 1.0
    notes: tuple[str, ...] = ()
    is_bare = raster.dtype.newbyteorder("=") == np.uint16 and (raster.scale, raster.offset_m) == (1.0, 0.0)
    seen = sample() if is_bare or spacing_m is None else None
    if seen and is_bare:
        scale, notes = plausible_scale(seen, known_m)
    if seen and spacing_m is None and not notes:
        chosen_m, notes = plausible_spacing(seen)
        known_m = chosen_m, chosen_m
    return Guess(scale, known_m, notes)


def plausible_scale(sample: Sample, spacing_m: Spacing) -> tuple[float, tuple[str, ...]]:
    """Metres per unit of 16-bit values that cannot be metres, because their range is above `HIGHEST_RELIEF_M`.

    The relief becomes a fifth of the longer side, at most 3000 m, and less if a tenth of the land would be steeper than
    `BOLD_SLOPE`.

    Returns
    -------
    (float, tuple of str)
        Metres per unit, and a note on the choice; 1 and no note if the values may be metres.
    """
    low, high = sample.low, sample.high
    if not high - low > HIGHEST_RELIEF_M:
        return 1.0, ()
    extent_m = max((n - 1) * step for n, step in zip(sample.shape, spacing_m[::-1], strict=True))
    scale = min(USUAL_RELIEF * extent_m, USUAL_RELIEF_M) / (high - low)
    steep = steep_slope(sample, spacing_m)
    scale = _one_digit(min(scale, BOLD_SLOPE / steep) if steep > 0 else scale)
    cannot = f"values {low:g} to {high:g} over {extent_m / 1000:.3g} km cannot be metres"
    return scale, (f"{cannot}: --z-scale {scale:g} is chosen; give --z-scale and --spacing",)


def plausible_spacing(sample: Sample) -> tuple[float, tuple[str, ...]]:
    """The spacing if none is given: 1 m, or more if the land would be too steep with 1 m.

    Returns
    -------
    (float, tuple of str)
        The spacing, and a note on the choice; 1 and no note if 1 m may be right.
    """
    side = max(sample.shape) - 1
    low, high = sample.low, sample.high
    if side < LEAST_SIDE - 1 or not 0 < high - low <= HIGHEST_RELIEF_M:
        return 1.0, ()
    steep = steep_slope(sample, (1.0, 1.0))
    if high - low <= STEEPEST_RELIEF * side and steep <= STEEPEST_SLOPE:
        return 1.0, ()
    usual_m = max(steep / USUAL_SLOPE, SPACINGS_M[0])
    nearest = min(SPACINGS_M, key=lambda choice: abs(math.log(choice / usual_m)))
    enough = [m for m in SPACINGS_M if m >= nearest and high - low <= STEEPEST_RELIEF * side * m]
    spacing_m = min(enough, default=SPACINGS_M[-1])
    if high - low > STEEPEST_RELIEF * side:
        cannot = f"heights {low:g} to {high:g} m are too steep over {side:,} m"
    else:
        cannot = f"posts 1 m apart would make a tenth of the land steeper than {_degrees(steep):.0f} degrees"
    return spacing_m, (f"{cannot}: --spacing {spacing_m:g} is chosen; give --spacing, or --z-scale",)


def not_of_the_earth(range_m: tuple[float, float]) -> tuple[str, ...]:
    """A note if no land on the Earth has such heights: then we do not know what grows there."""
    if EARTH_M[0] <= range_m[0] and range_m[1] <= EARTH_M[1]:
        return ()
    heights = f"no land on the Earth has heights {range_m[0]:g} to {range_m[1]:g} m"
    return (f"{heights}: drawn in grey, without air; give --z-scale, or --look",)


def steep_slope(sample: Sample, spacing_m: Spacing) -> float:
    """The slope that a tenth of the land exceeds, from one post to the next; 0 for land that is void or flat."""
    with np.errstate(invalid="ignore"):
        east = (sample.east - sample.here) / spacing_m[0]
        south = (sample.south - sample.here) / spacing_m[1]
        slopes = np.hypot(east, south)
    known = slopes[np.isfinite(slopes)]
    return float(np.percentile(known, 90)) if known.size else 0.0


def _degrees(slope: float) -> float:
    return math.degrees(math.atan(slope))


def _one_digit(value: float) -> float:
    """The largest number of one digit (times a power of ten) that is not above a value."""
    power = 10.0 ** math.floor(math.log10(value))
    return float(f"{math.floor(value / power * 1.0001) * power:.12g}")
