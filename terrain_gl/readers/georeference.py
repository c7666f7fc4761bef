"""Where a file lies: its grid, its coordinate system (CRS), and the metres between its posts.

They are in the file, in a world file beside it, or in its name. Degrees become metres on an ellipsoid; the units of a
projection that is not true to scale, by geodesics.
"""

from __future__ import annotations

import contextlib
import math
import os
import re
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple, Protocol

import numpy as np

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.readers.raster import INSTALL_GEO, Blocks, Raster, Spacing, gdal_failures, has_rasterio

LEAST_STEP = 1e-9  # least distance between posts that is accepted, in any unit
LARGEST_STEP = 1e6  # and the largest
FINEST_DEGREES = 0.1  # without a CRS, a step below this may be degrees
EVEN = 1e-3  # distances below this share of a post are rounding errors
TRUE_SCALE = 5e-3  # a map whose units are this near to metres on the ground keeps its own round numbers
MISSES = 0.01  # ground control points may miss the grid by this share of a post: they often have few digits
WGS84 = (6378137.0, 298.257223563)  # semi-major axis in metres, inverse flattening
_ROUNDING = 1e-7
DEGREES = "EPSG:4326"  # longitude and latitude on WGS 84
WORLD_FILES = (".wld", ".pgw", ".pngw", ".tfw", ".tifw", ".tiffw", ".jgw", ".bpw", ".exrw", ".hdrw")
_OPTION = re.compile(r"--(spacing|z-scale|z-offset|nodata) ([\d.eE+,-]+)")


class Grid(NamedTuple):
    """Affine transform: x = a·column + b·row + c, y = d·column + e·row + f."""

    a: float = 1.0
    b: float = 0.0
    c: float = 0.0
    d: float = 0.0
    e: float = 1.0
    f: float = 0.0

    @property
    def tells_nothing(self) -> bool:
        """Whether this is the default transform of rasters without a georeference."""
        return self == Grid()

    @property
    def is_south_up(self) -> bool:
        """Whether the first row is the southern one."""
        return self.e > 0 and not self.tells_nothing


class Georeference(NamedTuple):
    """Where a raster lies: its grid, a coordinate system or None, columns and rows.

    While a file is read, the coordinate system is an object of rasterio. The map keeps it as WKT, or as a name such as
    EPSG:4326.
    """

    grid: Grid
    crs: Any
    size: tuple[int, int]

    def kept(self) -> Georeference:
        """The georeference to keep with the map, with the northern row first."""
        grid = self.straightened().grid
        cols, rows = self.size
        if grid.is_south_up:
            grid = grid._replace(e=-grid.e, f=grid.f + rows * grid.e)
        crs = self.crs or (DEGREES if _may_be_degrees(self) else None)
        return Georeference(grid, crs if crs is None or isinstance(crs, str) else _wkt(crs), (cols, rows))

    def resampled(self, cols: int, rows: int) -> Georeference:
        """The georeference for another number of posts over the same land. The outermost posts keep their places."""
        grid = self.grid
        across, down = self.size
        a, e = grid.a * (across - 1) / (cols - 1), grid.e * (down - 1) / (rows - 1)
        return Georeference(
            grid._replace(a=a, e=e, c=grid.c + (grid.a - a) / 2, f=grid.f + (grid.e - e) / 2), self.crs, (cols, rows)
        )

    @property
    def middle(self) -> tuple[float, float]:
        """Map coordinates of the middle."""
        cols, rows = self.size
        return self.grid.c + self.grid.a * cols / 2, self.grid.f + self.grid.e * rows / 2

    def straightened(self) -> Georeference:
        """The same georeference, without a turn if it is only a rounding error: no post moves by more than `EVEN`."""
        grid = self.grid
        cols, rows = self.size
        if abs(grid.b) * rows <= EVEN * abs(grid.a) and abs(grid.d) * cols <= EVEN * abs(grid.e):
            grid = grid._replace(b=0.0, d=0.0)
        return self._replace(grid=grid)


class Placed(Protocol):
    """A map with a name and a place."""

    name: str
    georeference: Georeference | None


def at_place(raster: Raster, place: Georeference, about: str = "") -> Raster:
    """The raster with its place, the spacing there, and notes on both; the northern row comes first.

    Its description `about` may end in options for reading it, which our own writers put there.
    """
    raster = _as_described(raster, about)
    spacing_m, notes = _spacing_of(place, raster.name)
    return replace(
        raster,
        blocks=_north_up(raster.blocks, raster.shape[0]) if place.grid.is_south_up else raster.blocks,
        spacing_m=spacing_m or raster.spacing_m,
        notes=raster.notes + notes,
        georeference=place.kept() if spacing_m else None,
    )


def _north_up(blocks: Blocks, rows: int) -> Blocks:
    """Reverse blocks of whole rows that come from south to north."""
    with contextlib.closing(blocks):
        for where, pixels in blocks:
            yield slice(rows - where.stop, rows - where.start), pixels[::-1]


def _as_described(raster: Raster, text: str) -> Raster:
    """The raster with the options after "read with" in its description; wrong ones are ignored."""
    options = {name: _numbers(value) for name, value in _OPTION.findall(text.partition("read with ")[2])}
    spacing = options.get("spacing", [])
    z_scale, z_offset, nodata = (options.get(name, []) for name in ("z-scale", "z-offset", "nodata"))
    return replace(
        raster,
        spacing_m=(spacing[0], spacing[-1]) if 1 <= len(spacing) <= 2 and min(spacing) > 0 else raster.spacing_m,
        scale=raster.scale * (z_scale[0] if len(z_scale) == 1 and z_scale[0] else 1.0),
        offset_m=raster.offset_m + (z_offset[0] if len(z_offset) == 1 else 0.0),
        nodata=nodata[0] if len(nodata) == 1 else raster.nodata,
    )


def _numbers(text: str) -> list[float]:
    try:
        values = [float(word) for word in text.split(",")]
    except ValueError:
        return []
    return values if all(map(math.isfinite, values)) else []


def _spacing_of(place: Georeference, name: str) -> tuple[Spacing | None, tuple[str, ...]]:
    """Metres between posts, east and north, or None if the file does not give them; and notes for the user.

    Degrees, and the units of projections that are not true to scale, are converted in the middle of the map. Without a
    usable CRS, the map's own units are read as metres. Turned or mirrored rasters are refused.
    """
    place = place.straightened()
    grid = place.grid
    if grid.tells_nothing:
        return None, ()
    steps = grid.a, abs(grid.e)
    if not all(LEAST_STEP <= abs(step) <= LARGEST_STEP for step in steps) and not (grid.b and grid.d):
        note = f"its geotransform has posts {grid.a:g} x {-grid.e:g} apart: the spacing counts as 1 m (--spacing)"
        return None, (note,)
    if grid.b or grid.d or grid.a < 0:
        raise TerrainError(f"{name}: is not stored north up: turn it first with gdalwarp {name} north-up.tif")
    return _metres(place, steps)


def spacing_in_the_middle(place: Georeference, name: str) -> Spacing | None:
    """The spacing of a map whose coordinate system is kept as text; None if this is not known."""
    if place.crs is None or not has_rasterio():
        return None
    import rasterio

    return _spacing_of(place._replace(crs=rasterio.crs.CRS.from_user_input(place.crs)), name)[0]


def _metres(place: Georeference, steps: Spacing) -> tuple[Spacing, tuple[str, ...]]:
    crs = place.crs
    if crs is None and _may_be_degrees(place):
        note = f"no coordinate system, but {steps[0]:g} between posts: taken as degrees (--spacing)"
        east_m, north_m = metres_per_degree(place.middle[1])
        return (steps[0] * east_m, steps[1] * north_m), (note,)
    if crs is None:
        return steps, ()
    if crs.is_geographic:
        degrees = _degrees_per_unit(crs)
        east_m, north_m = metres_per_degree(place.middle[1] * degrees, *_ellipsoid(crs))
        return (steps[0] * (east_m * degrees), steps[1] * (north_m * degrees)), ()
    unit = _linear_unit_m(crs)
    if unit is None:
        note = (
            f"no map units in its coordinate system: spacing {steps[0]:g} x {steps[1]:g} counts as metres (--spacing)"
        )
        return steps, (note,)
    return _on_the_ground(place, steps, unit)


def _on_the_ground(place: Georeference, steps: Spacing, unit_m: float) -> tuple[Spacing, tuple[str, ...]]:
    """Metres between posts of a projected map: its units, or if these are not true on the ground, `ground_steps`."""
    told = steps[0] * unit_m, steps[1] * unit_m
    wkt = _wkt(place.crs) or ""
    try:
        ground = ground_steps(wkt, place.middle, steps)
    except TerrainError as error:
        is_true = "Transverse_Mercator" in wkt or "Transverse Mercator" in wkt  # within 0.1 % in its zone
        return told, () if is_true else (f"its units count as metres on the ground ({error}) (--spacing)",)
    if ground is None:
        return told, ("its middle has no longitude and latitude: its units count as metres on the ground (--spacing)",)
    is_true = all(abs(g / t - 1) <= TRUE_SCALE for g, t in zip(ground, told, strict=True))
    return told if is_true else ground, ()


def _may_be_degrees(place: Georeference) -> bool:
    grid = place.grid
    cols, rows = place.size
    east, south = grid.c + cols * grid.a, grid.f + rows * grid.e
    inside = max(abs(grid.c), abs(east)) <= 360 and max(abs(grid.f), abs(south)) <= 90
    return inside and max(grid.a, abs(grid.e)) <= FINEST_DEGREES


def _wkt(crs: Any) -> str | None:
    try:
        return str(crs.to_wkt())
    except gdal_failures():
        return None


def _degrees_per_unit(crs: Any) -> float:
    """Degrees in one unit of a geographic CRS: a few maps are in grads or radians."""
    try:
        return math.degrees(crs.units_factor[1])
    except gdal_failures():
        return 1.0


def _linear_unit_m(crs: Any) -> float | None:
    """Metres in one unit of a projected CRS; None for local, engineering, geocentric and vertical ones."""
    try:
        return float(crs.linear_units_factor[1]) if crs.is_projected else None
    except gdal_failures():
        return None


def _ellipsoid(crs: Any) -> tuple[float, float]:
    """Semi-major axis in metres and inverse flattening (0 for a sphere): not every map is of the Earth."""
    try:
        text = crs.to_wkt(version="WKT1_GDAL")
    except gdal_failures():
        return WGS84
    found = re.search(r'SPHEROID\["[^"]*",([\d.]+),([\d.]+)', text)
    return (float(found[1]), float(found[2])) if found else WGS84


def grid_through(posts: Sequence[tuple[float, float]], places: Sequence[tuple[float, float]]) -> Grid | None:
    """The grid that fits places of posts best (least squares); None if it misses one by more than `MISSES` posts."""
    columns_rows = np.column_stack([posts, np.ones(len(posts))])
    if np.linalg.matrix_rank(columns_rows) < 3:
        return None
    (a, d), (b, e), (c, f) = np.linalg.lstsq(columns_rows, np.asarray(places), rcond=None)[0]
    missed = columns_rows @ [(a, d), (b, e), (c, f)] - places
    if np.abs(missed).max() > MISSES * math.sqrt(abs(a * e - b * d)):
        return None
    # least squares leaves rounding errors in numbers that are 0
    return Georeference(Grid(*map(float, (a, b, c, d, e, f))), None, (1, 1)).straightened().grid


# --- Metres on the ground ---------------------------------------------------------------------------------------------


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


# --- World files and names --------------------------------------------------------------------------------------------


def world_file(path: str) -> Grid | None:
    """The grid in a world file beside an image: a, d, b, e, and x, y of the first post's centre."""
    stem = os.path.splitext(path)[0]
    for name in (stem + cased for ending in WORLD_FILES for cased in (ending, ending.upper())):
        if os.path.isfile(name) and not os.path.islink(name) and os.path.getsize(name) < 1000:
            with open(name, encoding="ascii", errors="replace") as file:
                words = file.read().replace(",", ".").split()
            try:
                a, d, b, e, x, y = (float(word) for word in words[:6])
            except ValueError:
                return None
            return Grid(a, b, x - (a + b) / 2, d, e, y - (d + e) / 2)
    return None


def hgt_place(path: str, side: int) -> tuple[Spacing | None, Georeference | None]:
    """Spacing and georeference of a tile: its outermost posts are on whole degrees."""
    corner = re.match(r"([NS])(\d\d)([EW])(\d\d\d)", os.path.basename(path).upper())
    if corner is None or side < 2:
        return None, None
    south, west = int(corner[2]) * (1 if corner[1] == "N" else -1), int(corner[4]) * (1 if corner[3] == "E" else -1)
    east, north = metres_per_degree(south + 0.5)
    step = 1 / (side - 1)
    grid = Grid(step, 0.0, west - step / 2, 0.0, -step, south + 1 + step / 2)
    return (east * step, north * step), Georeference(grid, DEGREES, (side, side))
