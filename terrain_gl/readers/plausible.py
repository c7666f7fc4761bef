"""What the heights themselves say, where the file does not: marks of voids, the scale, the spacing.

Heights of land have no gaps: between the lowest and the highest post, nearly every height occurs. A value that marks
voids, such as -9999 or 1e20, is far outside this range. A scale or a spacing that the file lacks is guessed. Heights
that the file declares are compared with the land of the Earth.
"""

import math
import re
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from terrain_gl.readers.raster import Raster, Spacing
from terrain_gl.readers.units import EARTH_M, FOOT_M, NAMES
from terrain_gl.readers.values import Reading

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
_ASKED = (FOOT_M, 0.1, 0.01, 1e-3)  # units that files often do not declare
STEEP = 1.5  # slope that a tenth of real land does not exceed, where posts are some metres apart
_SMOOTH_M = 10.0  # on finer maps, trees and walls are steeper
_STEEP_FINE = 5.0
_SEMI_MAJOR_M = 6.3e6, 6.4e6
_WINDOW = 128  # posts a side of a window in which heights are looked at
_WINDOWS = 4  # windows a side
GAP = 0.1  # a usual mark of voids is farther than this from all other heights, as a share of their range
HIGHEST_M = 1e5  # no body of the solar system has such heights
MOST_MARKS = 4  # most marks at one end of the heights
FEW = 1e-4  # least share of the posts for a note on a value that is not a usual mark
_BITS = (15, 16, 31, 32)  # not 8: an ordinary 8-bit map may have 0 and 255 as heights
# the ends of integer types and their neighbours, which programs use as marks of voids
_ENDS = {sign * 2**bits + off for bits in _BITS for sign in (-1, 1) for off in (-2, -1, 0, 1)}

Read = Callable[[slice, slice], np.ndarray]  # heights of rows and columns


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


def sample_of(read: Read, shape: tuple[int, int], strip: int) -> Sample:
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


def guess(
    read: Read, shape: tuple[int, int], strip: int, raster: Raster, reading: Reading, spacing_m: Spacing | None
) -> Guess:
    """A scale for a file that gives none, and a spacing if it is None; with notes, also on heights that cannot be true.

    A scale or an offset that the caller gives is believed. The map is read only where it must be: in blocks of `strip`
    rows for a guess, else in some windows.
    """
    if reading.is_told:
        return Guess(1.0, spacing_m or (1.0, 1.0), ())
    guessed = _guess(raster, lambda: sample_of(read, shape, strip), spacing_m)
    told = () if guessed.notes else contradictions(read, shape, guessed.spacing_m, raster, reading)
    return guessed._replace(notes=guessed.notes + told)


def _guess(raster: Raster, sample: Callable[[], Sample], spacing_m: Spacing | None) -> Guess:
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
    steep = _steep_slope(spacing_m, *sample[3:])
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
    steep = _steep_slope((1.0, 1.0), *sample[3:])
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


def _steep_slope(spacing_m: Spacing, here: np.ndarray, east: np.ndarray, south: np.ndarray) -> float:
    """The slope that a tenth of the land exceeds, from one post to the next; 0 for land that is void or flat."""
    with np.errstate(invalid="ignore"):
        slopes = np.hypot((east - here) / spacing_m[0], (south - here) / spacing_m[1])
    known = slopes[np.isfinite(slopes)]
    return float(np.percentile(known, 90)) if known.size else 0.0


def _one_digit(value: float) -> float:
    """The largest number of one digit (times a power of ten) that is not above a value."""
    power = 10.0 ** math.floor(math.log10(value))
    return float(f"{math.floor(value / power * 1.0001) * power:.12g}")


# --- Against the land of the Earth ------------------------------------------------------------------------------------


def contradictions(
    read: Read, shape: tuple[int, int], spacing_m: Spacing, raster: Raster, reading: Reading
) -> tuple[str, ...]:
    """Notes if the heights of a map with a place on the Earth cannot be metres up. `_WINDOWS`² windows are read."""
    meaning = raster.meaning
    scale = None if reading.is_packed else reading.scales(raster)[0]
    is_asked = any("--z-scale" in note for note in meaning.notes)
    if is_asked or raster.georeference is None or not _is_of_earth(raster.georeference.crs):
        return ()
    starts = [np.linspace(0, max(0, n - _WINDOW), _WINDOWS).astype(int) for n in shape]
    at = {(int(row), int(col)) for row in starts[0] for col in starts[1]}
    windows = [read(slice(y, min(y + _WINDOW, shape[0])), slice(x, min(x + _WINDOW, shape[1]))) for y, x in sorted(at)]
    heights = np.concatenate([each[np.isfinite(each)] for each in windows])
    if not heights.size:
        return ()
    low, high, middle = float(heights.min()), float(heights.max()), float(np.median(heights))
    corners = np.s_[:-1, :-1], np.s_[:-1, 1:], np.s_[1:, :-1]  # posts, and their neighbours east and south
    slope = _steep_slope(spacing_m, *(np.concatenate([each[at].ravel() for each in windows]) for at in corners))
    most = STEEP if min(spacing_m) >= _SMOOTH_M else _STEEP_FINE
    is_outside = low < EARTH_M[0] or high > EARTH_M[1]
    notes: tuple[str, ...] = ()
    if is_outside or slope > most:
        no_land = f"no land on the Earth has heights {low:g} to {high:g} m"
        steep = f"a tenth of the land would be steeper than {math.degrees(math.atan(slope)):.0f} degrees"
        if scale is None:
            return (f"{no_land if is_outside else steep}: give another --encoding",)
        asked = _ASKED if scale == 1 else _ASKED[1:]
        fits = [m for m in asked if slope * m <= most and EARTH_M[0] <= low * m and high * m <= EARTH_M[1]]
        names = {m: f" for {NAMES[m]}" if scale == 1 else "" for m in fits}
        choices = " or ".join(f"--z-scale {scale * m:g}{names[m]}" for m in fits[:3])
        notes = (f"{no_land if is_outside else steep}: give {choices or '--z-scale'}",)
    if scale is None:
        return ()
    if meaning.may_be_depth and middle > 0:
        notes += (f"its values are named depths, and count as {low:g} to {high:g} m up: give --z-scale {-scale:g}",)
    if meaning.metres < 0 < middle:
        notes += (f"declared as depths, but most of it is above 0: if they are heights, give --z-scale {-scale:g}",)
    return notes


def _is_of_earth(crs: str | None) -> bool:
    """Whether a coordinate system is on the ground of the Earth, by its ellipsoid."""
    found = re.search(r'^(?!GEOCCS|GEODCRS).*?(?:SPHEROID|ELLIPSOID)\["[^"]*",([\d.]+)', crs or "", re.DOTALL)
    return (crs or "").startswith("EPSG:") or (
        found is not None and _SEMI_MAJOR_M[0] < float(found[1]) < _SEMI_MAJOR_M[1]
    )


# --- Marks of voids ---------------------------------------------------------------------------------------------------


def undeclared_voids(heights: np.ndarray, scales: tuple[float, float]) -> tuple[tuple[float, ...], tuple[str, ...]]:
    """The heights that are marks of voids, and a note for the user on each.

    A usual mark (`is_usual`) at one end of the heights counts if it is farther from all other heights than a tenth of
    their range. If many posts have another value that is farther away than the whole range, there is only a note.

    `heights` are float32 metres, NaN where void; `scales` are those of height = value · scale + offset.
    """
    marks: list[float] = []
    ends = float(np.fmin.reduce(heights, None)), float(np.fmax.reduce(heights, None))
    if not any(is_usual(end, scales) for end in ends):
        step = max(1, max(heights.shape) // _SAMPLES)
        return (), _unusual(heights, heights[::step, ::step], scales)
    left = heights[np.isfinite(heights)]
    for is_low in (True, False, True):  # a mark at the high end may hide a mark at the low end
        found = _at_end(left, scales, is_low)
        marks += found
        left = left[~np.isin(left, np.array(found, np.float32))] if found else left
    if not marks:
        return (), _unusual(heights, left, scales)
    return tuple(marks), tuple(_note(heights, mark, scales, left) for mark in marks)


def is_usual(value: float, scales: tuple[float, float]) -> bool:
    """Whether programs write this height for "no data": nines, a power of ten, or an end of an integer type."""
    if not math.isfinite(value):
        return False
    stored = float(f"{(value - scales[1]) / scales[0]:.6g}")  # heights are float32
    ends = {float(f"{end:.6g}") for end in _ENDS}
    digits = f"{abs(stored):.15g}"
    is_nines = len(digits.replace(".", "")) >= 3 and set(digits) <= {"9", "."}
    is_power = abs(stored) >= 1e4 and set(digits.lstrip("1")) <= {"0"}
    return abs(value) > HIGHEST_M or stored in ends or is_nines or is_power


def _at_end(heights: np.ndarray, scales: tuple[float, float], is_low: bool) -> list[float]:
    """Usual no-data values among the lowest or the highest heights, the most extreme first."""
    found: list[float] = []
    while heights.size and len(found) < MOST_MARKS:
        end = float(heights.min() if is_low else heights.max())
        if not is_usual(end, scales):
            break
        found.append(end)
        heights = heights[heights > end] if is_low else heights[heights < end]
        if heights.size:
            low, high = float(heights.min()), float(heights.max())
            varied = high > low or end < 0 or abs(end) > HIGHEST_M  # a map of only 0 and 65535 is black and white
            if varied and abs((low if is_low else high) - end) > GAP * (high - low):
                return found
    return []


def _unusual(heights: np.ndarray, sample: np.ndarray, scales: tuple[float, float]) -> tuple[str, ...]:
    """A note if many posts have exactly one height, farther from all other heights than the range of these is wide."""
    sample = sample[np.isfinite(sample)]
    if not sample.size:
        return ()
    low, high = float(sample.min()), float(sample.max())
    middle = (low + high) / 2
    for end, is_away in ((low, sample < middle), (high, sample > middle)):
        away, others = sample[is_away], sample[~is_away]
        if len(away) >= max(2, FEW * sample.size) and (away == end).all() and others.min() < others.max():
            posts = np.count_nonzero(heights == np.float32(end))
            outside = f"{posts:,} posts have exactly {_stored(end, scales):.9g}, far from all others ({_range(others)})"
            return (f"{outside}: if they are voids, give --nodata {_stored(end, scales):.9g}",)
    return ()


def _note(heights: np.ndarray, mark: float, scales: tuple[float, float], left: np.ndarray) -> str:
    posts = np.count_nonzero(heights == np.float32(mark))
    have = f"{posts:,} posts have" if posts != 1 else "1 post has"
    value = f"{have} exactly {_stored(mark, scales):.9g}, far from all other heights ({_range(left)})"
    return f"{value}: it marks voids; if it is a height, give --nodata none"


def _stored(height: float, scales: tuple[float, float]) -> float:
    return float(f"{(height - scales[1]) / scales[0]:.7g}")


def _range(heights: np.ndarray) -> str:
    return f"{float(heights.min()):g} to {float(heights.max()):g} m" if heights.size else "none"


def without(heights: np.ndarray, marks: tuple[float, ...]) -> np.ndarray:
    """Set the posts with these heights to NaN, in place."""
    for mark in marks:
        heights[heights == np.float32(mark)] = math.nan
    return heights
