"""Light as spherical Gaussians: a sharp lobe for the sun, twelve fixed ones for the sky, one for the land around.

    SG(ω) = amplitude · e^(sharpness · (ω·axis − 1))                                  (Wang et al. 2009)

The sky's lobes never move: fitting a sky chooses their amplitudes alone, so what the land hides of each lobe depends on
the map and on nothing else. Shaders: `glsl/light/`. Specification: `reference.sg_integral` and its neighbours.

A lobe's *visible fraction* at a place is of its part above the level horizon, 1 on an open plain:

    V_l = ∫ SG_l V dω / ∫ SG_l dω,   both over z > 0;   for the sun, over the whole of its disc
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

# glsl/light/lights.glsl
LOBE = np.dtype([("axis", "3f4"), ("sharpness", "f4"), ("amplitude", "3f4"), ("pad", "f4")])
SUN_RADIUS_DEG = 0.2665  # of the sun's disc


def _ring(count: int, elevation_deg: float, turn: float = 0.0) -> np.ndarray:
    """(count, 3) unit vectors, evenly spread at one elevation."""
    azimuth = (np.arange(count) + turn) * (2 * np.pi / count)
    elevation = np.full(count, math.radians(elevation_deg))
    flat = np.cos(elevation)
    return np.stack([flat * np.sin(azimuth), flat * np.cos(azimuth), np.sin(elevation)], -1)


# Narrow where skies change fast, near the horizon: with these a cosine-weighted fit of clear skies errs by 1 to 4 %.
SKY_AXES = np.concatenate([_ring(8, 12.0), _ring(3, 50.0, 0.5), _ring(1, 90.0)])  # (12, 3), east, north, up
SKY_SHARPNESS = np.array([8.0] * 8 + [4.0] * 4)  # (12,)
GROUND_AXIS, GROUND_SHARPNESS = np.array([0.0, 0.0, -1.0]), 1.0


def lobes(axes: np.ndarray, sharpness: np.ndarray, amplitude: np.ndarray) -> np.ndarray:
    """Lobes as one record each: unit axes (n, 3), sharpness (n,), amplitude (n, 3) of linear RGB radiance."""
    made = np.zeros(len(axes), LOBE)
    made["axis"], made["sharpness"], made["amplitude"] = axes, sharpness, amplitude
    return made


def sun_sharpness(radius_deg: float = SUN_RADIUS_DEG) -> float:
    """Sharpness of the Gaussian that covers as much of the sphere as a disc of that radius."""
    return 1 / (1 - math.cos(math.radians(radius_deg)))


@dataclass(frozen=True)
class Lights:
    """All that lights a map.

    Attributes
    ----------
    sun
        A `LOBE`. Its amplitude fades while the disc sinks below the level horizon, and is 0 when it has set: at dusk
        the sky alone gives light.
    sky
        (12,) `LOBE`, with the axes and sharpness of `SKY_AXES` and `SKY_SHARPNESS`.
    ground
        A `LOBE` for the land around, from below; also what is seen where land hides the sky.
    """

    sun: np.ndarray
    sky: np.ndarray
    ground: np.ndarray
