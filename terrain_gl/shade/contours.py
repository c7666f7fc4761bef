"""Contour lines: the interval for a map, and the uniform that the shader needs (glsl/shade/contours.glsl)."""

import math
from typing import Any

from ..basics.words import UNITS
from ..terrain import Terrain

MOST = 40  # most lines from the lowest to the highest post
INDEX_EVERY = 5  # every fifth line is an index line, which is bolder
_ASIDE = 1e-3  # a line is drawn this share of an interval too high; else it would cover a plain that lies at its height


def interval_m(low_m: float, high_m: float, units: str = "m") -> float:
    """The interval: the smallest of 1, 2 and 5 times a power of ten, in `units`, that gives at most `MOST` parts."""
    least = max(high_m - low_m, 1e-6) / MOST / UNITS[units]
    power = 10.0 ** math.floor(math.log10(least))
    return UNITS[units] * next(digit * power for digit in (1, 2, 5, 10) if digit * power >= least * (1 - 1e-9))


def uniforms(terrain: Terrain, asked_m: float, units: str, water_m: float | None) -> dict[str, Any]:
    """The uniform for contour lines every `asked_m` metres; with 0, every `interval_m`. Water hides lines."""
    metres = asked_m or interval_m(*terrain.heightmap.range_m, units)
    aside_m = max(_ASIDE * metres, terrain.span_m / 65535)  # at least one step of the heights that shading reads
    added_m = (terrain.base_m - aside_m) % (INDEX_EVERY * metres)
    least_m = -math.inf if water_m is None else water_m - terrain.base_m
    return {"contours": (metres, added_m, max(least_m, -1e30))}
