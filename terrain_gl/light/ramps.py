"""Colour ramps of values: the ramp's name, the range that it shows, and its colours in linear light.

A diverging ramp is for differences: its middle is white, and by default stands for 0. Other ramps are for other values.
"""

import math
from typing import NamedTuple

import numpy as np

from ..image import linear_from_srgb

AUTO = "auto"
STOPS = 10  # colours of a ramp: glsl/shade/cover.glsl
_SRGB = {
    # Smith, van der Walt 2015, at ten even places
    "viridis": "440154 482878 3e4989 31688e 26828e 1f9e89 35b779 6dcd59 b4de2c fde725",
    # Brewer 2003, RdBu: losses are red, gains are blue
    "diverging": "b2182b d6604d f4a582 fddbc7 f7f7f7 d1e5f0 92c5de 4393c3 2166ac",
    "grey": "101010 f0f0f0",
}
NAMES = (AUTO, *_SRGB)
LOOKS = ("viridis", "diverging")  # looks of the land that are ramps of heights
Range = tuple[float, float]


class Ramp(NamedTuple):
    """A ramp, and the values at its ends."""

    name: str
    low: float
    high: float

    @property
    def srgb(self) -> np.ndarray:
        """(n, 3) uint8 colours at even places from low to high."""
        return np.array([list(bytes.fromhex(colour)) for colour in _SRGB[self.name].split()], np.uint8)

    def colours(self, values: np.ndarray) -> np.ndarray:
        """Linear colours (..., 3) float32 of values (...). Values beyond the range have the colours of its ends."""
        stops = linear_from_srgb(self.srgb)
        at = np.clip((values.astype(np.float64) - self.low) / (self.high - self.low), 0, 1) * (len(stops) - 1)
        places = np.arange(len(stops))
        return np.stack([np.interp(at, places, stops[:, i]) for i in range(3)], -1).astype("f4")

    @property
    def stops(self) -> list[tuple[float, ...]]:
        """`STOPS` colours in linear light, each with its value: the uniform of glsl/shade/cover.glsl."""
        values = np.linspace(self.low, self.high, STOPS if len(self.srgb) > STOPS - 1 else len(self.srgb))
        values = np.append(values, [self.high] * (STOPS - len(values)))
        return [(*map(float, colour), float(value)) for colour, value in zip(self.colours(values), values, strict=True)]


class Values(NamedTuple):
    """A raster of values that colours the ground by a ramp.

    Attributes
    ----------
    path
        The file of the raster.
    ramp
        One of `NAMES`.
    range
        The values at the ends of the ramp; None for those of the raster.
    """

    path: str
    ramp: str = AUTO
    range: Range | None = None


class Photo(NamedTuple):
    """A picture of the ground, and the values of black and white; None for those of `light.tones`."""

    path: str
    range: Range | None = None


Ground = Photo | Values  # what colours the ground


def ramp_for(low: float, high: float, name: str = AUTO, asked: Range | None = None) -> Ramp:
    """The ramp of values from `low` to `high`.

    Parameters
    ----------
    name
        One of `NAMES`; "auto" is "diverging" if there are values on both sides of 0.
    asked
        The values at the ends. By default they are `low` and `high`; for a diverging ramp they are −d and d, with d the
        larger distance from 0. Both are rounded outwards, to the second digit of their difference.
    """
    if name == AUTO:
        is_difference = (low < 0 < high) if asked is None else asked[0] < 0 < asked[1]
        name = "diverging" if is_difference else "viridis"
    if asked is None:
        far = max(abs(low), abs(high))
        low, high = (-far, far) if name == "diverging" else (low, high)
        step = 10.0 ** (math.floor(math.log10(max(high - low, 1e-6))) - 1)
        asked = math.floor(low / step + 1e-6) * step, math.ceil(high / step - 1e-6) * step
    return Ramp(name, asked[0], max(asked[1], asked[0] + 1e-6 * max(1.0, abs(asked[0]))))
