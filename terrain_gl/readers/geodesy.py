"""Metres per degree on an ellipsoid."""

from __future__ import annotations

import math

WGS84 = (6378137.0, 298.257223563)


def metres_per_degree(
    latitude: float, semi_major_m: float = WGS84[0], inverse_flattening: float = WGS84[1]
) -> tuple[float, float]:
    """Length of one degree east and one degree north on an ellipsoid, in metres.

    These are N cos φ and M times π/180. N = a / √(1 − e² sin² φ) and M = a (1 − e²) / (1 − e² sin² φ)^{3/2} are the
    radii of curvature of the prime vertical and of the meridian (Snyder 1987, Map Projections, eqs. 4-19 to 4-21).
    """
    flattening = 1 / inverse_flattening if inverse_flattening else 0.0
    e2 = flattening * (2 - flattening)
    phi = math.radians(latitude)
    w2 = 1 - e2 * math.sin(phi) ** 2
    east = semi_major_m / math.sqrt(w2) * math.cos(phi)
    north = semi_major_m * (1 - e2) / w2**1.5
    return math.radians(east), math.radians(north)
