"""Where a map lies on the Earth: world metres, coordinates of its file, longitude and latitude.

World metres count from the south-west post: x east, y north. They are converted to columns and rows, and the columns
and rows to the file's coordinates. So a place is exact, and does not depend on how the spacing was measured.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from ..basics.exceptions import TerrainError, UsageError
from .georeference import DEGREES, EVEN, Georeference, Placed, flat_crs, to_own_angles
from .raster import Spacing

Point = tuple[float, float]
_NORTH_STEP = 1e-4  # degrees of latitude over which the direction of north is measured
_NORTH_DIGITS = 5


@dataclass(frozen=True)
class Place:
    """Where a map lies: its georeference, and metres between posts, east and north."""

    georeference: Georeference
    spacing_m: Spacing

    @property
    def crs(self) -> str | None:
        """The coordinate system, as WKT or a name; None if it is unknown."""
        crs: str | None = self.georeference.crs
        return crs

    @property
    def name(self) -> str:
        """The coordinate system in a few words, such as EPSG:32632."""
        if self.crs is None:
            return "unknown coordinates"
        if self.crs == DEGREES:
            return DEGREES
        crs = flat_crs(self.crs)
        code = crs.to_authority(min_confidence=70)
        return ":".join(code) if code else str(crs.name)

    def to_map(self, x: float, y: float) -> Point:
        """The file's coordinates of a place in world metres."""
        grid = self.georeference.grid
        _, rows = self.georeference.size
        col, row = x / self.spacing_m[0], rows - 1 - y / self.spacing_m[1]
        return grid.a * (col + 0.5) + grid.c, grid.e * (row + 0.5) + grid.f

    def from_map(self, easting: float, northing: float) -> Point:
        """World metres of a place in the file's coordinates."""
        grid = self.georeference.grid
        _, rows = self.georeference.size
        col, row = (easting - grid.c) / grid.a - 0.5, (northing - grid.f) / grid.e - 0.5
        return col * self.spacing_m[0], (rows - 1 - row) * self.spacing_m[1]

    def as_neighbours(self, lefts: np.ndarray, widths: np.ndarray) -> np.ndarray:
        """First columns of several maps on this grid, moved by whole turns if all maps together are narrower then.

        Tiles from 179 to 180 and from -180 to -179 degrees are neighbours.
        """
        try:
            turn = (self._turn or 0) / self.georeference.grid.a
        except TerrainError:  # pyproj is missing
            return lefts
        if turn < 1 or abs(turn - round(turn)) > EVEN:
            return lefts
        choices = [lefts, *((lefts - first) % round(turn) + first for first in np.unique(lefts))]
        return min(choices, key=lambda choice: int((choice + widths).max() - choice.min()))

    def nearest_turn(self, eastings: np.ndarray, is_line: bool = False) -> np.ndarray:
        """The same places with coordinates near the map's: whole turns around the Earth are added.

        Longitudes are equal modulo 360 degrees: on a map from 280 to 290, a place at -75 is at 285. A line stays in one
        piece, even if it crosses the meridian at which its coordinates begin anew.
        """
        turn = self._turn
        if turn is None or not len(eastings):
            return eastings
        middle = self.georeference.middle[0]
        if not is_line:
            return eastings + turn * np.round((middle - eastings) / turn)
        line = np.unwrap(eastings, period=turn)
        return line + turn * np.round((middle - (line.min() + line.max()) / 2) / turn)

    @property
    def _turn(self) -> float | None:
        """360 degrees of longitude in map units; None in systems where this is not the same shift everywhere."""
        if self.crs == DEGREES:
            return 360.0
        return _turn_of(self.crs) if self.crs else None

    def to_lonlat(self, x: float, y: float) -> Point:
        """Degrees of longitude and latitude of a place in world metres.

        Raises
        ------
        TerrainError, UsageError
            pyproj is missing; the coordinate system is unknown, or the place has no such coordinates.
        """
        return self._turned(self.to_map(x, y), "FORWARD")

    def from_lonlat(self, lon: float, lat: float) -> Point:
        """World metres of a place in degrees of longitude and latitude. Raises the same errors as `to_lonlat`."""
        easting, northing = self._turned((lon, lat), "INVERSE")
        return self.from_map(float(self.nearest_turn(np.array([easting]))[0]), northing)

    @property
    def middle(self) -> Point:
        """Degrees of longitude and latitude of the map's middle. Raises the same errors as `to_lonlat`."""
        cols, rows = self.georeference.size
        east, north = self.spacing_m
        return self.to_lonlat((cols - 1) * east / 2, (rows - 1) * north / 2)

    @property
    def north_deg(self) -> float:
        """Direction of true north in the middle of the map, in degrees clockwise from the grid's north (y).

        0 if the coordinate system is unknown, or pyproj is missing.
        """
        return _north_of(self)

    def _turned(self, point: Point, direction: str) -> Point:
        if self.crs is None:
            raise UsageError("the map has no coordinate system: give it one with gdal_translate -a_srs")
        if self.crs == DEGREES:
            return point
        x, y = to_degrees(self.crs).transform(*point, direction=direction)
        if not (math.isfinite(x) and math.isfinite(y)):
            raise UsageError(f"{point[0]:g}, {point[1]:g} has no place in {self.name}")
        return x, y


def degrees(lon: float, lat: float) -> str:
    """Longitude and latitude as text: 46.50000° N 7.10000° E."""
    lon = (lon + 180) % 360 - 180
    return f"{abs(lat):.5f}° {'N' if lat >= 0 else 'S'} {abs(lon):.5f}° {'E' if lon >= 0 else 'W'}"


@lru_cache(maxsize=16)
def _north_of(place: Place) -> float:
    try:
        lon, lat = place.middle
        step = _NORTH_STEP if lat < 0 else -_NORTH_STEP  # away from the pole
        (x, y), (x1, y1) = place.from_lonlat(lon, lat), place.from_lonlat(lon, lat + step)
    except TerrainError:
        return 0.0
    found = math.degrees(math.atan2((x1 - x) / step, (y1 - y) / step))
    return round(found, _NORTH_DIGITS) + 0.0  # never -0


@lru_cache(maxsize=16)
def to_degrees(crs: str) -> Any:
    """The transformer to longitude and latitude: on WGS 84, or on the ellipsoid of another planet."""
    flat = flat_crs(crs)  # raises an error if pyproj is missing
    import pyproj

    try:
        return pyproj.Transformer.from_crs(flat, DEGREES, always_xy=True)
    except pyproj.exceptions.ProjError:
        return to_own_angles(crs)


@lru_cache(maxsize=16)
def _turn_of(crs: str) -> float | None:
    """A full turn around the Earth in units of a coordinate system; None where east and west do not repeat.

    They repeat in degrees, and in cylindrical projections, whose meridians are parallel lines.
    """
    flat = flat_crs(crs)  # raises an error if pyproj is missing
    if flat.is_geographic:
        return 2 * math.pi / float(flat.axis_info[0].unit_conversion_factor)
    to_map = to_degrees(crs)
    x, y = to_map.transform([-60.0, 30.0, 120.0, 30.0], [10.0, 10.0, 10.0, 50.0], direction="INVERSE")
    if not all(map(math.isfinite, x + y)):
        return None
    is_cylindrical = abs(x[3] - x[1]) < 1e-3 and max(y[:3]) - min(y[:3]) < 1e-3
    # one of these two quarters of a turn may cross the meridian at which the system begins anew
    return 4 * min(abs(x[1] - x[0]), abs(x[2] - x[1])) if is_cylindrical else None


def check_crs(file: Placed, other: Placed) -> None:
    """Refuse a file in another coordinate system, such as the next zone of UTM: equal numbers would be other places.

    Systems that differ by less than a post are accepted, and so are maps without a system.
    """
    mine = file.georeference
    grid = other.georeference
    if not (mine and grid and mine.crs and grid.crs) or mine.crs == grid.crs:
        return
    here = flat_crs(mine.crs), flat_crs(grid.crs)  # raises an error if pyproj is missing
    import pyproj

    corner = mine.grid.c, mine.grid.f
    try:
        x, y = pyproj.Transformer.from_crs(*here, always_xy=True).transform(*corner)
    except pyproj.exceptions.ProjError:
        x = y = math.inf
    if not (abs(x - corner[0]) <= abs(grid.grid.a) and abs(y - corner[1]) <= abs(grid.grid.e)):
        raise TerrainError(f"{file.name}: has another coordinate system than {other.name}: convert it first")
