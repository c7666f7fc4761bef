"""Light as spherical Gaussians: a sharp lobe for the sun, nine fixed ones for the sky.

    SG(ω) = amplitude · e^(sharpness · (ω·axis − 1))                                  (Wang et al. 2009)

The sky's lobes never move: fitting a sky chooses their amplitudes alone, so what the land hides of each lobe depends
on the map and on nothing else. Shaders: `glsl/light/`. Specification: `reference.sg_integral` and its neighbours.

A lobe's *visible fraction* at a place is of its part above the level horizon, 1 on an open plain:

    V_l = ∫ SG_l V dω / ∫ SG_l dω,   both over z > 0;   for the sun, over the whole of its disc
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

# glsl/light/lights.glsl
LOBE = np.dtype(
    [
        ("axis", "3f4"),
        ("sharpness", "f4"),
        ("amplitude", "3f4"),
        ("mean_length", "f4"),
        ("hidden", "3f4"),
        ("integral", "f4"),
    ]
)
LIGHTS = np.dtype(
    [
        ("sun", LOBE),
        ("sky", LOBE, 9),
        ("around", "3f4"),
        ("exposure", "f4"),
        ("haze_m", "f4"),
        ("water_m", "f4"),
        ("pad", "2f4"),
    ]
)
SUN_RADIUS_DEG = 0.2665  # of the sun's disc


def _ring(count: int, elevation_deg: float, turn: float = 0.0) -> np.ndarray:
    """(count, 3) unit vectors, evenly spread at one elevation."""
    azimuth = (np.arange(count) + turn) * (2 * np.pi / count)
    elevation = np.full(count, math.radians(elevation_deg))
    flat = np.cos(elevation)
    return np.stack([flat * np.sin(azimuth), flat * np.cos(azimuth), np.sin(elevation)], -1)


# Narrow where skies change fast, near the horizon: on ground of any orientation the light of lobes fitted to clear
# skies is at worst 1 to 3 % of the brightest off; that of a uniform sky 0.8 %.
SKY_AXES = np.concatenate([_ring(6, 8.0), _ring(2, 50.0, 0.5), _ring(1, 90.0)])  # (9, 3), east, north, up
SKY_SHARPNESS = np.array([12.0] * 6 + [4.0] * 3)  # (9,)


def lobes(axes: np.ndarray, sharpness: np.ndarray, amplitude: np.ndarray) -> np.ndarray:
    """Lobes as one record each: unit axes (n, 3), sharpness k (n,) > 0, amplitude (n, 3) of linear RGB radiance.

    With them go `mean_length`, coth k - 1/k, `integral`, that of an amplitude of 1, and `hidden`, what amplitude the
    land itself has where it hides the lobe: 0 here.
    """
    made = np.zeros(len(axes), LOBE)
    made["axis"], made["sharpness"], made["amplitude"] = axes, sharpness, amplitude
    rest = np.exp(-np.minimum(2 * np.asarray(sharpness, float), 80))
    made["mean_length"] = (1 + rest) / (1 - rest) - 1 / np.asarray(sharpness, float)
    made["integral"] = 2 * math.pi * (1 - rest) / sharpness
    return made


def non_negative_least_squares(A: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The x ≥ 0 that makes |A x - b| smallest (Lawson and Hanson 1974, "Solving least squares problems", 23)."""
    normal, right = A.T @ A, A.T @ b
    x, free = np.zeros(A.shape[1]), np.zeros(A.shape[1], bool)
    enough = 1e-10 * max(float(np.abs(right).max()), 1e-300)
    while True:
        gain = np.where(free, -np.inf, right - normal @ x)
        if gain.max() <= enough:
            return x
        free[gain.argmax()] = True
        while True:
            step = np.zeros_like(x)
            step[free] = np.linalg.solve(normal[np.ix_(free, free)], right[free])
            below = free & (step <= 0)
            if not below.any():
                break
            x = x + float((x[below] / (x[below] - step[below])).min()) * (step - x)
            free &= x > 1e-12 * x.max()
            x = np.where(free, x, 0.0)
        x = step


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
        (9,) `LOBE`, with the axes and sharpness of `SKY_AXES` and `SKY_SHARPNESS`.
    around
        (3,) radiance of the land around, the same from everywhere below the horizon.
    """

    sun: np.ndarray
    sky: np.ndarray
    around: np.ndarray
