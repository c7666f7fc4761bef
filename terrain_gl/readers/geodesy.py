"""Metres on the ground: of a degree on an ellipsoid, and of a step in any coordinate system."""

import math
from functools import lru_cache
from typing import Any

import numpy as np

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.readers.raster import INSTALL_GEO, Spacing

WGS84 = (6378137.0, 298.257223563)  # semi-major axis in metres, inverse flattening
_ROUNDING = 1e-7


def metres_per_degree(
    latitude: float, semi_major_m: float = WGS84[0], inverse_flattening: float = WGS84[1]
) -> tuple[float, float]:
    """Length of one degree east and one degree north on an ellipsoid, in metres.

    The lengths are π/180 · N cos φ and π/180 · M at the latitude φ. N = a / √(1 − e² sin² φ) and
    M = a (1 − e²) / (1 − e² sin² φ)^{3/2} are the radii of curvature of the prime vertical and of the meridian; a is
    the semi-major axis, e the eccentricity (Snyder 1987, Map Projections, eqs. 4-19 to 4-21).
    """
    flattening = 1 / inverse_flattening if inverse_flattening else 0.0
    e2 = flattening * (2 - flattening)
    phi = math.radians(latitude)
    w2 = 1 - e2 * math.sin(phi) ** 2
    east = semi_major_m / math.sqrt(w2) * math.cos(phi)
    north = semi_major_m * (1 - e2) / w2**1.5
    return math.radians(east), math.radians(north)


def ground_steps(crs: str, middle: tuple[float, float], steps: Spacing) -> Spacing | None:
    """Metres on the ground of one step of a map, east and north; None if its middle has no longitude and latitude.

    Lengths are geodesics on the CRS's ellipsoid, which may be another planet's. `middle`, the middle of both steps, and
    the lengths `steps` are in map units. `TerrainError` as for `flat_crs`.
    """
    flat = flat_crs(crs)
    x, y = middle
    # shorter steps would be lost in the rounding of coordinates
    east, north = (max(step, _ROUNDING * max(abs(x), abs(y))) for step in steps)
    ends = [x - east / 2, x + east / 2, x, x], [y, y, y - north / 2, y + north / 2]
    angles = np.array(to_own_angles(crs).transform(*ends))
    if not np.isfinite(angles).all():
        return None
    lon, lat = angles * math.degrees(flat.geodetic_crs.axis_info[0].unit_conversion_factor)
    _, _, (east_m, north_m) = flat.get_geod().inv(lon[::2], lat[::2], lon[1::2], lat[1::2])
    ground = float(east_m) * steps[0] / east, float(north_m) * steps[1] / north
    return ground if all(0 < metres < math.inf for metres in ground) else None


@lru_cache(maxsize=16)
def to_own_angles(crs: str) -> Any:
    """The transformer to longitude and latitude on the CRS's own datum, which may be another planet's."""
    flat = flat_crs(crs)  # raises an error if pyproj is missing
    import pyproj

    try:
        return pyproj.Transformer.from_crs(flat, flat.geodetic_crs, always_xy=True)
    except (pyproj.exceptions.ProjError, TypeError):
        raise TerrainError(f"{flat.name} has no longitude and latitude") from None


def flat_crs(crs: Any) -> Any:
    """The pyproj CRS without its vertical part; `TerrainError` if pyproj is missing, or does not know the CRS."""
    try:
        import pyproj
    except ImportError:
        raise TerrainError(f"coordinate systems need pyproj: {INSTALL_GEO}") from None
    try:
        made = pyproj.CRS.from_user_input(crs)
    except pyproj.exceptions.CRSError:
        raise TerrainError(f"{' '.join(str(crs).split())[:60]!r} is no coordinate system that PROJ knows") from None
    return made.sub_crs_list[0] if made.is_compound else made.to_2d()
