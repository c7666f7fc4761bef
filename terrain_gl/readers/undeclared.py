"""Values that mark voids although the file does not say so: -9999, -32768, 1e20 and others.

Heights of land have no gaps: between the lowest and the highest post, nearly every height occurs. A value that marks
voids is far outside this range.
"""

from __future__ import annotations

import math

import numpy as np

GAP = 0.1  # a usual mark of voids is farther than this from all other heights, as a share of their range
HIGHEST_M = 1e5  # no body of the solar system has such heights
MOST_MARKS = 4  # most marks at one end of the heights
_SAMPLES = 1024  # posts a side where unusual values are looked for
FEW = 1e-4  # least share of the posts for a note on a value that is not a usual mark
_BITS = (15, 16, 31, 32)  # not 8: an ordinary 8-bit map may have 0 and 255 as heights
# the ends of integer types and their neighbours, which programs use as marks of voids
_ENDS = {sign * 2**bits + off for bits in _BITS for sign in (-1, 1) for off in (-2, -1, 0, 1)}


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
