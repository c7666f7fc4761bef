"""Where tiles stand: in the Earth-centred system EPSG:4978, or in local metres of the south-western post.

Heights of the map are taken as heights above the ellipsoid.
"""

import numpy as np

from ..basics.exceptions import TerrainError
from ..heightmap import Heightmap
from ..readers.georeference import WGS84, flat_crs
from ..readers.place import to_degrees
from ..readers.raster import INSTALL_GEO

RADIUS_M = 6.35e6  # of the Earth, at least
_OTHER_PLANET = 0.01  # an ellipsoid that differs by more is not the Earth's


class TileSystem:
    """The system of a map's tiles. `is_local`: metres east, north and up; it is flat, as the map is."""

    def __init__(self, heightmap: Heightmap, is_local: bool = False) -> None:
        self.rows = heightmap.rows
        self.spacing_m = heightmap.spacing_m
        self.is_local = is_local
        if is_local:
            return
        self.place = heightmap.place
        if self.place is None or self.place.crs is None:
            raise TerrainError(f"{heightmap.name}: does not say where it lies: the Earth's tiles need a map that does")
        try:
            import pyproj
        except ImportError:
            raise TerrainError(f"tiles need pyproj: {INSTALL_GEO}") from None
        if abs(flat_crs(self.place.crs).ellipsoid.semi_major_metre / WGS84[0] - 1) > _OTHER_PLANET:
            raise TerrainError(f"{heightmap.name}: lies on another planet than the Earth: give --local")
        self._to_degrees = to_degrees(self.place.crs)
        self._to_earth = pyproj.Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)

    def to_world(self, posts: np.ndarray, tops_m: np.ndarray) -> np.ndarray:
        """(n, 3) places of (n, 2) columns and rows with heights."""
        col, row = posts.T
        if self.is_local:
            east, north = self.spacing_m
            return np.stack([col * east, (self.rows - 1 - row) * north, tops_m], -1)
        assert self.place
        grid = self.place.georeference.grid
        lon, lat = self._to_degrees.transform(grid.a * (col + 0.5) + grid.c, grid.e * (row + 0.5) + grid.f)
        return np.stack(self._to_earth.transform(lon, lat, np.asarray(tops_m, np.float64)), -1)

    def to_map(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Columns and rows (n, 2), and heights, of places: the inverse of `to_world`."""
        if self.is_local:
            east, north = self.spacing_m
            return np.stack([places[:, 0] / east, self.rows - 1 - places[:, 1] / north], -1), places[:, 2]
        assert self.place
        x, y, z = places.T
        lon, lat, tops_m = self._to_earth.transform(x, y, z, direction="INVERSE")
        easting, northing = self._to_degrees.transform(lon, lat, direction="INVERSE")
        grid = self.place.georeference.grid
        col = (self.place.nearest_turn(np.asarray(easting)) - grid.c) / grid.a - 0.5
        return np.stack([col, (np.asarray(northing) - grid.f) / grid.e - 0.5], -1), np.asarray(tops_m)

    def axes(self, col: float, row: float, top_m: float) -> np.ndarray:
        """(4, 4) transformation to the world from metres along a row of the map, across it, and up, at a post."""
        steps = self.to_world(np.array([[col, row], [col + 1, row], [col, row]]), np.array([top_m, top_m, top_m + 1]))
        up = steps[2] - steps[0]
        up /= np.linalg.norm(up)
        across = np.cross(up, steps[1] - steps[0])
        across /= np.linalg.norm(across)
        matrix = np.eye(4)
        matrix[:3] = np.stack([np.cross(across, up), across, up, steps[0]], -1)
        return matrix

    def sag_m(self, length_m: float) -> float:
        """How far the middle of a chord lies below the ground, at most."""
        return 0.0 if self.is_local else length_m**2 / (8 * RADIUS_M)
