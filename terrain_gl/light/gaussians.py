"""Light as spherical Gaussians: one sharp lobe for the sun, nine fixed lobes for the sky.

    SG(ω) = amplitude · e^(sharpness · (ω·axis − 1))                                  (Wang et al. 2009)

The sky's lobes never move: fitting a sky chooses only their amplitudes. So the visible fraction of each lobe depends on
the map alone. Shaders: `glsl/light/`. Specification: `reference.light`.

The *visible fraction* V_l of lobe l at a place counts only directions above the horizontal, z > 0. It is 1 on an
open plain. V(ω) is 1 where the sky is visible and 0 where land hides it:

    V_l = ∫ SG_l V dω / ∫ SG_l dω,   both over z > 0;   for the sun, over its whole disc
"""

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


def directions_of(azimuth: np.ndarray, elevation: np.ndarray) -> np.ndarray:
    """Unit vectors (..., 3), east, north, up; angles in radians, azimuths clockwise from north."""
    flat = np.cos(elevation)
    parts = flat * np.sin(azimuth), flat * np.cos(azimuth), np.sin(elevation)
    return np.stack(np.broadcast_arrays(*parts), -1)


def _ring(count: int, elevation_deg: float, turn: float = 0.0) -> np.ndarray:
    """(count, 3) unit vectors, evenly spread at one elevation."""
    azimuth = (np.arange(count) + turn) * (2 * np.pi / count)
    return directions_of(azimuth, np.full(count, math.radians(elevation_deg)))


# Lobes are narrow near the horizon, where skies change fast. Fitted to clear skies, their light on ground of any
# orientation is wrong by at most 1 to 3 % of the largest such light; fitted to a uniform sky, by 0.8 %.
SKY_AXES = np.concatenate([_ring(6, 8.0), _ring(2, 50.0, 0.5), _ring(1, 90.0)])  # (9, 3), east, north, up
SKY_SHARPNESS = np.array([12.0] * 6 + [4.0] * 3)  # (9,)


def lobes(axes: np.ndarray, sharpness: np.ndarray, amplitude: np.ndarray) -> np.ndarray:
    """Records `LOBE` of unit axes (n, 3), sharpness k (n,) > 0 and amplitude (n, 3), linear RGB radiance.

    Computed fields: `mean_length`, the length of the mean direction, coth k - 1/k; `integral`, for an amplitude of 1.
    `hidden` is the amplitude of land that hides the lobe: 0 here.
    """
    made = np.zeros(len(axes), LOBE)
    made["axis"] = axes
    made["sharpness"] = sharpness
    made["amplitude"] = amplitude
    rest = np.exp(-np.minimum(2 * np.asarray(sharpness, float), 80))
    made["mean_length"] = (1 + rest) / (1 - rest) - 1 / np.asarray(sharpness, float)
    made["integral"] = 2 * math.pi * (1 - rest) / sharpness
    return made


def non_negative_least_squares(A: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The x ≥ 0 that minimises |A x - b| (Lawson and Hanson 1974, "Solving least squares problems", chapter 23)."""
    normal = A.T @ A
    right = A.T @ b
    x = np.zeros(A.shape[1])
    free = np.zeros(A.shape[1], bool)
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
    """Sharpness of the Gaussian whose integral is the solid angle of a disc of that radius."""
    return 1 / (1 - math.cos(math.radians(radius_deg)))


@dataclass(frozen=True)
class Lights:
    """All light on a map: records `LOBE` of the sun and of the nine lobes of the sky, and the radiance `around`.

    The sun's amplitude fades while the disc sinks below the level horizon. It is 0 after sunset: only the sky gives
    light then. `around` is the radiance (3,) of the surrounding land, the same from all directions below the horizon.
    """

    sun: np.ndarray
    sky: np.ndarray
    around: np.ndarray
