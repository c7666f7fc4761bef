"""Stage 1, the heightmap: metres above datum on a regular grid of posts; posts without data are voids.

h[row, col], row 0 is the north edge. World: x = col·s_x east, y = (rows − 1 − row)·s_y north, z up, metres.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from copy import copy
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from terrain_gl.basics.boxes import over_blocks
from terrain_gl.basics.exceptions import TerrainError, UsageError
from terrain_gl.basics.limits import check_size
from terrain_gl.basics.rect import span_of
from terrain_gl.readers import Raster, Reading, Spacing, open_raster
from terrain_gl.readers.georeference import Georeference
from terrain_gl.readers.objects import raster_of
from terrain_gl.readers.place import Place
from terrain_gl.readers.plausible import (
    guess,
    not_of_the_earth,
    plausible_spacing,
    sample_of,
    undeclared_voids,
    without,
)
from terrain_gl.readers.values import AS_STORED, read_heights
from terrain_gl.sight import Sight, bend_per_m, lines_of_sight, seen_from

MIN_SPACING_M = 1e-6
MAX_SPACING_M = 1e6
RANGE_BLOCK = 64  # posts a side of a block; an edited map keeps the lowest and highest height of each block
MAX_HEIGHT_M = 1e7  # above this, float32 has steps of a metre, and a value is most likely an unknown no-data mark


class Heightmap:
    """Heights in metres at the posts of a regular grid.

    Parameters
    ----------
    heights : array_like, shape (rows, cols)
        Metres; NaN, ±Inf and masked values are voids. A C-contiguous float32 array without ±Inf is not copied.
    spacing_m : float or (east, north)
        Metres between neighbouring posts.
    name : str
        The map's name in messages.

    Attributes
    ----------
    heights : numpy.ndarray, float32, shape (rows, cols)
        Metres, NaN where void, C-contiguous.
    voids : int
        Number of void posts.
    range_m, quantised_m : (float, float)
        Lowest and highest height; and the range that gives the tables their units: `units_for`.
    opened : dict, optional
        The arguments of `open`; None for a map that was not opened from a file, or was edited since.
    assumes_spacing : bool
        The spacing is a guess: neither the file nor the caller gave one.
    values : str
        What the file's values are, such as "US survey feet", "metres down" or "metres (no unit is given)".
    scales : (float, float)
        Metres per unit of the file's values, and the height of value 0.
    notes : tuple of str
        Notes for the user on how the file was interpreted.
    georeference : Georeference, optional
        Grid and coordinate system; `place` turns them into coordinates.
    look : str
        How the land is coloured by default, one of `light.climate.NAMES`.
    exaggeration : float
        How many times higher the relief is drawn; see `exaggerated`.
    of_earth : bool
        Whether the map may be of the Earth, by its heights, its coordinates and the scale that the caller gave.

    Raises
    ------
    TerrainError, UsageError
        Not a 2-D array of at least 2 × 2 real numbers, all void, a height beyond `MAX_HEIGHT_M`, or a bad spacing.
    """

    exaggeration = 1.0
    values = "metres"
    is_store = False  # whether the map is read page by page: `pages.map.PagedMap`
    _ground_spacing_m: Spacing | None = None

    def __init__(self, heights: ArrayLike, spacing_m: float | Spacing = 1.0, name: str = "array"):
        self.name = name
        self.opened: dict[str, Any] | None = None
        self.scales = (1.0, 0.0)
        self.notes: tuple[str, ...] = ()
        self.georeference: Georeference | None = None
        self.assumes_spacing = False
        self.look = "auto"
        self.spacing_m = _spacing(spacing_m)
        values = real_heights(heights, name)
        if values.ndim != 2:
            raise TerrainError(f"{name}: expected heights of shape (rows, cols), got {values.shape}")
        check_size(values.shape[0], values.shape[1], name)
        self.heights = _rounded(values, name)
        void = ~np.isfinite(self.heights)
        self.voids = int(np.count_nonzero(void))
        if self.voids == self.heights.size:
            raise TerrainError(f"{name}: every post is void (no-data, NaN or Inf): check the no-data value")
        if np.isinf(self.heights[void]).any():
            self.heights = np.where(void, np.float32(np.nan), self.heights)
        self.range_m = self._checked(np.fmin.reduce(self.heights, None), np.fmax.reduce(self.heights, None))
        self.quantised_m = units_for(self.range_m, self.spacing_m)
        self.of_earth = not not_of_the_earth(self.range_m)
        self._lows: np.ndarray | None = None  # lowest heights of blocks of RANGE_BLOCK posts a side
        self._highs: np.ndarray | None = None

    @classmethod
    def open(
        cls,
        path: str | os.PathLike[str],
        spacing_m: float | Spacing | None = None,
        z_scale: float | None = None,
        z_offset_m: float | None = None,
        nodata: float | None = None,
        encoding: str = "plain",
        progress: Callable[[float], None] | None = None,
        trusted: bool = False,
        band: int | str | None = None,
        raw: tuple[int, int] | None = None,
        byte_order: str | None = None,
    ) -> Heightmap:
        """Read a map from a file: PNG, TIFF, EXR, HDR, NPY, SRTM HGT and, with rasterio, others of docs/maps.md.

        A post's height is value · z_scale + z_offset_m, computed in float64 and stored in float32.

        Parameters
        ----------
        path : str or path
        spacing_m : float or (east, north), optional
            Metres between posts; by default from the file's tags or the name of a .hgt tile, else 1.
        z_scale, z_offset_m : float, optional
            Metres per unit of value, and the height of value 0; by default from the file's tags, else 1 and 0.
        nodata : float, optional
            A further value that marks voids, besides the file's own. NaN, ±Inf and full transparency always mark voids;
            −32768 marks them in .hgt files, and in other signed 16-bit files without a no-data value. By default, some
            values that programs write for voids, such as −9999, also mark voids if they are far from all other heights;
            a note says so. With NaN, only the file's own value marks voids.
        encoding : {"plain", "terrarium", "mapbox", "gsi", "custom:R,G,B,OFFSET"}
            How pixels store heights: in one channel, or packed in the three channels of an 8-bit colour image; with
            "custom:1,0.5,0.25,-100", a height is red + green / 2 + blue / 4 − 100 metres.
        progress : function, optional
            Called with the progress, 0 to 1; an exception that it raises ends the reading.
        trusted : bool
            Let GDAL follow the file to other files and the network: see docs/maps.md.
        band : int or str, optional
            The band that holds the heights, from 1, or its name, in a file with several bands.
        raw : (int, int), optional
            Columns and rows of a file without a header, in which each post is 1 or 2 bytes, or a 4-byte float.
        byte_order : {"little", "big"}, optional
            Byte order of the numbers in such a file; by default the order that gives smoother land.

        Raises
        ------
        TerrainError, UsageError
            The file is not a readable heightmap of at least 2 × 2 posts; or an option is outside its range.
        """
        reading = Reading(trusted, band, raw, byte_order, z_scale, z_offset_m, nodata, encoding)
        return cls.of_raster(open_raster(path, reading), reading, spacing_m, progress, os.fspath(path))

    @classmethod
    def of(cls, source: Any, spacing_m: float | Spacing | None = None, name: str | None = None) -> Heightmap:
        """A map from a path, an array or another object with heights.

        Parameters
        ----------
        source
            A `Heightmap`; a path; a DataArray of xarray, with rioxarray or without; a dataset of rasterio; or an array.
        spacing_m : float or (east, north), optional
            Metres between posts; by default the spacing in the source, else a guess, as for files; a note says which.

        Raises
        ------
        TerrainError, UsageError
            The same errors as `open` and `Heightmap` raise.
        """
        if isinstance(source, cls):
            return source
        if isinstance(source, str | os.PathLike):
            return cls.open(source, spacing_m)
        name = name or str(getattr(source, "name", None) or type(source).__name__)
        raster = raster_of(source, name)
        if raster is not None:
            return cls.of_raster(raster, AS_STORED, spacing_m)
        heightmap = cls(source, 1.0 if spacing_m is None else spacing_m, name)
        if spacing_m is None:
            heights = heightmap.heights
            found = plausible_spacing(sample_of(lambda *window: heights[window], heights.shape, len(heights)))
            if found.notes:
                heightmap = cls(heights, found.spacing_m, name)
                heightmap.notes = found.notes
            heightmap.assumes_spacing = True
        return heightmap

    @classmethod
    def of_raster(
        cls,
        raster: Raster,
        reading: Reading,
        spacing_m: float | Spacing | None,
        progress: Callable[[float], None] | None = None,
        path: str | None = None,
    ) -> Heightmap:
        """A map from an open raster, which this reads to its end; `path` is the file that `open` reads again."""
        check_size(*raster.shape[:2], raster.name)
        known_m = spacing_m if spacing_m is not None else raster.spacing_m
        spacing = _spacing(1.0 if known_m is None else known_m)
        scales = reading.scales(raster)
        heights = read_heights(raster, reading, progress)
        notes = reading.unanswered(raster.notes, spacing_m)
        if reading.nodata is None:
            marks, words = undeclared_voids(heights, scales)
            heights = without(heights, marks)
            notes = notes + words
        shape = raster.shape[:2]
        guessed = guess(lambda *at: heights[at], shape, shape[0], raster, reading, None if known_m is None else spacing)
        if guessed.scale != 1:  # the product is rounded to float32 once
            np.multiply(heights, guessed.scale, out=heights, dtype=np.float64, casting="same_kind")
        heightmap = cls(heights, guessed.spacing_m, raster.name)
        heightmap.opened = None if path is None else {"path": path, "spacing_m": spacing_m} | asdict(reading)
        heightmap.values = raster.meaning.words
        heightmap.assumes_spacing = known_m is None
        heightmap.of_earth = heightmap.of_earth or reading.is_told or raster.georeference is not None
        heightmap.scales = (scales[0] * guessed.scale, scales[1])
        heightmap.notes = notes + guessed.notes
        if not heightmap.of_earth:
            heightmap.notes += not_of_the_earth(heightmap.range_m)
        heightmap.georeference = raster.georeference
        return heightmap

    def coarse(self) -> Heightmap:
        """A map that is quick to read as a whole, for choosing a view: this one, or a coarse level of a store."""
        return self

    def copy(self, heights: np.ndarray | None = None) -> Heightmap:
        """A copy of the map with its own heights, or with `heights` instead, (rows, cols) metres."""
        own = Heightmap(self.heights.copy() if heights is None else heights, self.spacing_m, self.name)
        kept = "opened", "values", "scales", "georeference", "look", "assumes_spacing", "of_earth"
        for name in (*kept, "exaggeration", "_ground_spacing_m"):
            setattr(own, name, getattr(self, name))
        own.quantised_m = self.quantised_m if heights is None else units_for(own.range_m, self.ground_spacing_m)
        return own

    def exaggerated(self, factor: float) -> Heightmap:
        """A map with the same posts whose relief is drawn `factor` times as high.

        Heights stay true. Instead, the distances between posts are divided by the factor. In perspective, this gives
        the same picture if the camera's position is scaled in the same way (`Camera.over_exaggerated`).
        """
        drawn = copy(self)
        drawn.exaggerate(factor)
        return drawn

    def exaggerate(self, factor: float) -> None:
        """Change this map in place into the one that `exaggerated` returns."""
        self._ground_spacing_m = east, north = self.ground_spacing_m
        self.spacing_m = east / factor, north / factor
        self.exaggeration = factor

    @property
    def ground_spacing_m(self) -> Spacing:
        """Metres between posts, without the effect of exaggeration."""
        return self._ground_spacing_m or self.spacing_m

    def write(self, x: int, y: int, heights: ArrayLike) -> tuple[slice, slice] | None:
        """Give posts new heights. Only the first call reads the whole map; others read little more than these posts.

        Parameters
        ----------
        x, y
            Column and row of the first post.
        heights : array_like, shape (rows, cols)
            Metres; NaN, ±Inf and masked values are voids.

        Returns
        -------
        (slice, slice), optional
            The smallest rectangle of rows and columns with all changed posts; None if no post changed.

        Raises
        ------
        TerrainError, UsageError
            No real numbers, heights beyond `MAX_HEIGHT_M`, or every post would be void. The map is then unchanged.
        """
        new = _rounded(np.array(real_heights(heights, self.name), ndmin=2), self.name)
        new[~np.isfinite(new)] = np.nan
        place = np.s_[y : y + new.shape[0], x : x + new.shape[1]]
        old = self.heights[place]
        # compare bits, because undo must also restore the sign of 0; all NaN are equal
        changed = (old.view(np.uint32) != new.view(np.uint32)) & ~(np.isnan(old) & np.isnan(new))
        if not changed.any():
            return None
        self._checked(np.fmin.reduce(new, None), np.fmax.reduce(new, None))
        voids = self.voids + int(np.isnan(new).sum()) - int(np.isnan(old).sum())
        if voids == self.heights.size:
            raise TerrainError(f"{self.name}: every post would be void")
        old[changed] = new[changed]
        self.opened = None
        self.voids = voids
        rows, cols = (span_of(changed.any(axis), first) for axis, first in ((1, y), (0, x)))
        self._follow_range(rows, cols)
        return rows, cols

    def part(self, rows: slice, cols: slice) -> np.ndarray:
        """The true heights of a rectangle of posts, (rows, cols) float32 metres; it may be a view of `heights`."""
        return self.heights[rows, cols]

    def height_at(self, x: ArrayLike, y: ArrayLike) -> np.ndarray:
        """The true heights at places in world metres, bilinear between posts; NaN over voids and off the map.

        Parameters
        ----------
        x, y
            Metres east and north of the south-western post: numbers, or arrays of one shape.
        """
        east, north = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(y, np.float64))
        spacing_m = self.ground_spacing_m
        heights = bilinear(self.heights, east.ravel() / spacing_m[0], self.rows - 1 - north.ravel() / spacing_m[1])
        return heights.reshape(east.shape)[()]

    def bend_per_m(self, curvature: str, refraction: float) -> float:
        """1 / 2R, with the radius in effect, for one of `sight.CURVATURES`; 0 if the map is drawn flat."""
        return bend_per_m(self.georeference, max(self.extent_m), curvature, refraction)

    def sees(self, a: ArrayLike, b: ArrayLike, curvature: str = "auto", refraction: float = 0.0) -> Sight:
        """Whether places see each other over the land, and which place hides the rest. It is exact on the true surface.

        Parameters
        ----------
        a, b
            World metres (..., 3). An eye on the ground is at ``(x, y, terrain.height_at(x, y) + 1.7)``.
        curvature, refraction
            As in `Renderer.render`. The land is lower the further it is from a.

        Returns
        -------
        Sight
            `seen`, `hidden_by` and `clearance_m`, one for each pair.

        Raises
        ------
        UsageError
            Places that are no finite numbers, or an option outside its range.
        """
        bend = self.bend_per_m(curvature, refraction)
        return lines_of_sight(self.heights, self.ground_spacing_m, a, b, bend)

    def viewshed(
        self, a: ArrayLike, above_m: float = 0.0, curvature: str = "auto", refraction: float = 0.0
    ) -> np.ndarray:
        """Which posts a place sees: (rows, cols) bool. One exact line of sight for each post.

        Parameters
        ----------
        a
            World metres (3,).
        above_m
            How far above the ground the things stand that are looked for. Voids are not seen.
        curvature, refraction
            As for `sees`.
        """
        row, col = np.indices((self.rows, self.cols))
        spacing_m = self.ground_spacing_m
        heights = self.part(slice(0, self.rows), slice(0, self.cols))
        posts = np.stack([col * spacing_m[0], (self.rows - 1 - row) * spacing_m[1], heights + above_m], -1)
        known = np.isfinite(heights)
        seen = np.zeros(known.shape, bool)
        bend = self.bend_per_m(curvature, refraction)
        seen[known] = seen_from(heights, spacing_m, a, posts[known], bend)
        return seen

    @property
    def rows(self) -> int:
        """Posts north to south."""
        return self.heights.shape[0]

    @property
    def cols(self) -> int:
        """Posts west to east."""
        return self.heights.shape[1]

    @property
    def place(self) -> Place | None:
        """Where the map lies on the Earth; None if this is not known."""
        return Place(self.georeference, self.spacing_m) if self.georeference else None

    @property
    def north_deg(self) -> float:
        """Direction of true north in degrees clockwise from the grid's north; 0 if the place is unknown."""
        return self.place.north_deg if self.place else 0.0

    @property
    def extent_m(self) -> Spacing:
        """Metres from the first post to the last, east and north."""
        return (self.cols - 1) * self.spacing_m[0], (self.rows - 1) * self.spacing_m[1]

    def __repr__(self) -> str:
        low, high = self.range_m
        return f"<Heightmap {self.name}: {self.cols} x {self.rows} posts, {low:g} to {high:g} m, {self.voids} voids>"

    def _checked(self, low: float, high: float) -> Spacing:
        if max(-low, high) > MAX_HEIGHT_M:
            raise TerrainError(
                f"{self.name}: heights run from {low:.9g} to {high:.9g} m, beyond ±{MAX_HEIGHT_M:g}: "
                "name the no-data value (--nodata) or scale them (--z-scale)"
            )
        return float(low), float(high)

    def _follow_range(self, rows: slice, cols: slice) -> None:
        """Update the range from the blocks that hold these posts."""
        if self._lows is None or self._highs is None:
            self._lows, self._highs = (over_blocks(of, self.heights, RANGE_BLOCK) for of in (np.fmin, np.fmax))
        blocks = tuple(slice(s.start // RANGE_BLOCK, -(-s.stop // RANGE_BLOCK)) for s in (rows, cols))
        part = self.heights[tuple(slice(s.start * RANGE_BLOCK, s.stop * RANGE_BLOCK) for s in blocks)]
        self._lows[blocks] = over_blocks(np.fmin, part, RANGE_BLOCK)
        self._highs[blocks] = over_blocks(np.fmax, part, RANGE_BLOCK)
        self.range_m = float(np.fmin.reduce(self._lows, None)), float(np.fmax.reduce(self._highs, None))


# --- Checks -----------------------------------------------------------------------------------------------------------


def real_heights(heights: ArrayLike, name: str) -> np.ndarray:
    """Real numbers of any type as an array of any shape; masked values become NaN. `UsageError` for other values."""
    is_masked = type(heights) is not np.ndarray and isinstance(heights, np.ma.MaskedArray)  # np.ma is slow to import
    try:
        values: Any = heights if is_masked else np.asarray(heights)
    except ValueError:
        raise UsageError(f"{name}: expected real heights, got rows of different lengths: {heights!r:.60}") from None
    except TypeError:  # a DataTree of xarray, for example
        raise UsageError(f"{name}: expected an array of heights, got {type(heights).__name__}") from None
    if values.dtype.kind not in "iufb":
        raise UsageError(f"{name}: expected real heights, got {values.dtype}: {values.ravel()[:3]!s:.60}")
    return np.ma.filled(values.astype(np.float64), np.nan) if is_masked else values


def ground_m(heightmap: Heightmap, places: np.ndarray) -> np.ndarray:
    """Heights at world places (..., 2); NaN over voids and outside the map."""
    east, north = np.atleast_2d(places).T / np.array(heightmap.spacing_m)[:, None]
    return bilinear(heightmap.heights, east, heightmap.rows - 1 - north)


def bilinear(heights: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Heights at fractional columns x and rows y, in float64; NaN beside void posts and outside the map."""
    rows, cols = heights.shape
    outside = ~((x >= 0) & (x <= cols - 1) & (y >= 0) & (y <= rows - 1))
    col = np.clip(np.floor(np.where(outside, 0, x)), 0, cols - 2).astype(int)
    row = np.clip(np.floor(np.where(outside, 0, y)), 0, rows - 2).astype(int)
    u, v = x - col, y - row

    def share(east: int, south: int) -> np.ndarray:
        weight = (u if east else 1 - u) * (v if south else 1 - v)
        return np.where(weight == 0, 0.0, weight * heights[row + south, col + east])  # 0 · NaN would be NaN

    return np.where(outside, np.nan, share(0, 0) + share(1, 0) + share(0, 1) + share(1, 1))


def _rounded(heights: np.ndarray, name: str) -> np.ndarray:
    """Convert to float32; a finite value that float32 cannot hold is an error."""
    with np.errstate(all="ignore"):
        rounded = np.ascontiguousarray(heights, np.float32)
    if np.can_cast(heights.dtype, np.float32):
        return rounded
    overflown = np.isinf(rounded) & np.isfinite(heights)
    if overflown.any():
        most = float(np.abs(heights[overflown]).max())
        raise TerrainError(f"{name}: heights up to ±{most:.9g} m, beyond ±{MAX_HEIGHT_M:g}: scale them")
    return rounded


def units_for(range_m: tuple[float, float], spacing_m: Spacing) -> tuple[float, float]:
    """The range that gives a map's tables their units. It is a cell high at least, so that flat maps can be edited."""
    low, high = range_m
    return low, max(high, low + math.sqrt(spacing_m[0] * spacing_m[1]))


def _spacing(spacing_m: float | Spacing) -> Spacing:
    try:
        east, north = (float(s) for s in np.broadcast_to(np.asarray(spacing_m, np.float64), 2))
    except (TypeError, ValueError):
        east = north = math.nan
    if not (min(east, north) >= MIN_SPACING_M and max(east, north) <= MAX_SPACING_M):
        raise UsageError(
            f"spacing must be one or two numbers of metres (east, north) from {MIN_SPACING_M:g} to {MAX_SPACING_M:g}, "
            f"got {spacing_m}"
        )
    return east, north
