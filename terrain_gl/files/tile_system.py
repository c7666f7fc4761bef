"""Where tiles and meshes stand: in a coordinate system, by pyproj, or in local metres of the south-western post.

In the Earth-centred system EPSG:4978, heights of the map are heights above the ellipsoid. Other systems keep heights.
"""

from typing import Any

import numpy as np

from ..basics.exceptions import TerrainError
from ..heightmap import Heightmap
from ..readers.georeference import WGS84, flat_crs
from ..readers.place import to_degrees

EARTH = "EPSG:4978"  # metres from the middle of the Earth
RADIUS_M = 6.35e6  # of the Earth, at least
_OTHER_PLANET = 0.01  # an ellipsoid that differs by more is not the Earth's


class TileSystem:
    """The world in which tiles of a map stand; `crs` is its system. None: local metres east, north and up.

    Attributes
    ----------
    is_local
        Whether straight lines of the world are straight on the map.
    """

    def __init__(self, heightmap: Heightmap, crs: str | None = EARTH) -> None:
        self.rows = heightmap.rows
        self.spacing_m = heightmap.spacing_m
        self._steps: list[Any] = []  # from the map's coordinates to the world's
        self.is_local = crs is None
        if crs is None:
            return
        self.place = heightmap.place
        if self.place is None or self.place.crs is None:
            raise TerrainError(f"{heightmap.name}: does not say where it lies: the Earth's tiles need a map that does")
        world, own = flat_crs(crs), flat_crs(self.place.crs)  # raises an error if pyproj is missing
        import pyproj

        self.is_local = world == own
        if world.is_geographic and not self.is_local:
            raise TerrainError(f"{crs}: is in degrees: expected a projected or Earth-centred system, or the map's")
        if not world.is_geocentric:
            try:
                self._steps = [pyproj.Transformer.from_crs(own, world, always_xy=True)]
            except pyproj.exceptions.ProjError:
                raise TerrainError(f"{heightmap.name}: {crs} is of another planet than the map") from None
        elif abs(own.ellipsoid.semi_major_metre / WGS84[0] - 1) > _OTHER_PLANET:
            raise TerrainError(f"{heightmap.name}: lies on another planet than the Earth: give --local")
        else:
            to_world = pyproj.Transformer.from_crs("EPSG:4979", world, always_xy=True)
            self._steps = [to_degrees(self.place.crs), to_world]

    def to_world(self, posts: np.ndarray, tops_m: np.ndarray) -> np.ndarray:
        """(n, 3) places of (n, 2) columns and rows with heights."""
        col, row = posts.T
        if not self._steps:
            east, north = self.spacing_m
            return np.stack([col * east, (self.rows - 1 - row) * north, tops_m], -1)
        assert self.place
        grid = self.place.georeference.grid
        at = grid.a * (col + 0.5) + grid.c, grid.e * (row + 0.5) + grid.f, np.asarray(tops_m, np.float64)
        for step in self._steps:
            at = step.transform(*at)
        return np.stack(at, -1)

    def to_map(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Columns and rows (n, 2), and heights, of places: the inverse of `to_world`."""
        if not self._steps:
            return np.stack([places[:, 0], -places[:, 1]], -1) / self.spacing_m + [0, self.rows - 1], places[:, 2]
        assert self.place
        at = tuple(places.T)
        for step in reversed(self._steps):
            at = step.transform(*at, direction="INVERSE")
        easting, northing, tops_m = map(np.asarray, at)
        grid = self.place.georeference.grid
        col = (self.place.nearest_turn(easting) - grid.c) / grid.a - 0.5
        return np.stack([col, (northing - grid.f) / grid.e - 0.5], -1), tops_m

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
