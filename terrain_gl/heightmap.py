"""Stage 1, the heightmap: metres above datum on a regular grid of posts, with holes where no height is known.

h[row, col], row 0 is the north edge. World: x = col·s_x east, y = (rows − 1 − row)·s_y north, z up, metres.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from terrain_gl.exceptions import TerrainError, UsageError
from terrain_gl.place import Place
from terrain_gl.readers import How, Spacing, open_raster
from terrain_gl.readers.georeference import Georeference
from terrain_gl.readers.plausible import plausible_scale
from terrain_gl.readers.values import ENCODINGS, read_heights

MAX_POSTS = 16384 * 16384
MIN_SPACING_M, MAX_SPACING_M = 1e-6, 1e6
MAX_SIDE = 16385  # so many posts does a quadtree of 15 levels reach over
RANGE_BLOCK = 64  # posts a side of the blocks whose lowest and highest heights are known, once a map is edited
MAX_HEIGHT_M = 1e7  # beyond it float32 has steps above a metre, and a value is most likely an unnamed no-data mark


class Heightmap:
    """Heights in metres at the posts of a regular grid.

    Parameters
    ----------
    heights : array_like, shape (rows, cols)
        Metres, any real type; NaN, ±Inf and what a masked array hides are voids. A C-contiguous float32 array without
        ±Inf is not copied.
    spacing_m : float or (east, north)
        Metres between neighbouring posts.
    name : str
        What messages call the map.

    Attributes
    ----------
    heights : numpy.ndarray, float32, shape (rows, cols)
        Metres, NaN where void, C-contiguous.
    spacing_m : (float, float)
        Metres between posts, east and north.
    voids : int
        Number of void posts.
    range_m : (float, float)
        Lowest and highest height.
    quantised_m : (float, float)
        Lowest and highest height that the quantisation range must hold: `range_m`, until edits ask for more.
    opened : dict, optional
        What `open` was told, by the names of its arguments; None for a map of other origin, or edited since.
    assumes_spacing : bool
        Neither the file nor who opened it said how far posts are apart.
    scales : (float, float)
        Metres per unit of the file's values, and the height of value 0.
    notes : tuple of str
        What the user should know of how the file was understood.
    georeference : Georeference, optional
        Grid and coordinate system; `place` turns them into coordinates.

    Raises
    ------
    TerrainError
        Not a 2-D array of at least 2 × 2 posts, all void, or heights out of all measure.
    UsageError
        No real numbers, or a spacing that is not positive.
    """

    def __init__(self, heights: ArrayLike, spacing_m: float | Spacing = 1.0, name: str = "array"):
        self.name = name
        self.opened: dict[str, Any] | None = None
        self.assumes_spacing = False
        self.scales = (1.0, 0.0)
        self.notes: tuple[str, ...] = ()
        self.georeference: Georeference | None = None
        self.spacing_m = _spacing(spacing_m)
        self.heights = _as_float32(real_heights(heights, name), name)
        void = ~np.isfinite(self.heights)
        self.voids = int(np.count_nonzero(void))
        self._mark_voids(void)
        self.range_m = self._checked(np.fmin.reduce(self.heights, None), np.fmax.reduce(self.heights, None))
        self.quantised_m = self.range_m
        self._lows: np.ndarray | None = None  # of blocks of RANGE_BLOCK posts a side
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
        band: int | None = None,
        raw: tuple[int, int] | None = None,
    ) -> Heightmap:
        """Read a map from a file: PNG, TIFF, EXR, HDR, NPY, SRTM HGT and, with rasterio, whatever GDAL opens.

        A post's height is value · z_scale + z_offset_m, computed in float64 and stored in float32.

        Parameters
        ----------
        path : str or path
        spacing_m : float or (east, north), optional
            Metres between posts; without it, what the file's tags or the name of a .hgt tile say, else 1.
        z_scale, z_offset_m : float, optional
            Metres per unit of value, and the height of value 0; without them, what the file's tags say, else 1 and 0.
        nodata : float, optional
            A value that marks voids, beside the one that the file names. NaN, ±Inf and full transparency always
            do; −32768 does in .hgt, and in other signed 16-bit files that name no value of their own.
        encoding : {"plain", "terrarium", "mapbox"}
            How pixels hold heights: as one channel, or packed in the three of an 8-bit colour image.
        progress : function, optional
            Told the part done, 0 to 1, now and then; an exception that it raises ends the reading.
        trusted : bool
            Let GDAL open the file by any of its drivers, which may read other files and the network. Without it, only
            the file is read, its headers beside it, and, of a mosaic (.vrt), the files beside and below that.
        band : int, optional
            The band that holds the heights, from 1, in a file of several.
        raw : (int, int), optional
            The file is bare posts without a header, of so many columns and rows: 1 or 2 bytes each, or 4 of a float.

        Raises
        ------
        TerrainError
            The file cannot be read, or does not hold a heightmap of at least 2 × 2 posts.
        UsageError
            An option is out of its range.
        """
        _check_options(z_scale, z_offset_m, encoding, band)
        raster = open_raster(path, How(trusted, band, raw))
        rows, cols, _ = raster.shape
        _check_size(rows, cols, raster.name)
        spacing = _spacing(_first_known(spacing_m, raster.spacing_m, 1.0))
        scales = _first_known(z_scale, raster.scale), _first_known(z_offset_m, raster.offset_m)
        heights = read_heights(raster, scales, nodata, encoding, progress)
        notes = raster.notes if spacing_m is None else ()
        if z_scale is None and z_offset_m is None and encoding == "plain":
            extent_m = max((cols - 1) * spacing[0], (rows - 1) * spacing[1])
            factor, words = plausible_scale(raster, heights, extent_m)
            scales, notes = (scales[0] * factor, scales[1]), notes + words
        heightmap = cls(heights, spacing, raster.name)
        told: dict[str, Any] = {"spacing_m": spacing_m, "z_scale": z_scale, "z_offset_m": z_offset_m, "nodata": nodata}
        told |= {"encoding": encoding, "trusted": trusted, "band": band, "raw": raw}
        heightmap.opened = {"path": os.fspath(path)} | told
        heightmap.assumes_spacing = spacing_m is None and raster.spacing_m is None
        heightmap.scales, heightmap.notes = scales, notes
        heightmap.georeference = raster.georeference
        return heightmap

    def copy(self) -> Heightmap:
        """The same map with heights of its own."""
        own = Heightmap(self.heights.copy(), self.spacing_m, self.name)
        own.quantised_m, own.opened, own.scales = self.quantised_m, self.opened, self.scales
        own.georeference = self.georeference
        return own

    def write(self, x: int, y: int, heights: ArrayLike) -> tuple[slice, slice] | None:
        """Give posts new heights, in time that grows with their number alone.

        Parameters
        ----------
        x, y
            Column and row of the first post.
        heights : array_like, shape (rows, cols)
            Metres; NaN, ±Inf and what a masked array hides are voids.

        Returns
        -------
        (slice, slice), optional
            Rows and columns that hold all posts that changed; None if none did.

        Raises
        ------
        UsageError
            No real numbers.
        TerrainError
            Heights out of all measure, or no post would be left that is not void. The map is as it was then.
        """
        new = _rounded(np.array(real_heights(heights, self.name), ndmin=2), self.name)
        new[~np.isfinite(new)] = np.nan
        place = np.s_[y : y + new.shape[0], x : x + new.shape[1]]
        old = self.heights[place]
        # bit by bit, for 0 is not -0 where a stroke is undone; but one NaN is as good as another
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
        rows, cols = (_span_of(changed.any(axis), first) for axis, first in ((1, y), (0, x)))
        self._follow_range(rows, cols)
        return rows, cols

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
        """Where the map lies on the Earth; None if nothing tells."""
        return Place(self.georeference, self.spacing_m) if self.georeference else None

    @property
    def extent_m(self) -> Spacing:
        """Metres from the first post to the last, east and north."""
        return (self.cols - 1) * self.spacing_m[0], (self.rows - 1) * self.spacing_m[1]

    def __repr__(self) -> str:
        low, high = self.range_m
        return f"<Heightmap {self.name}: {self.cols} x {self.rows} posts, {low:g} to {high:g} m, {self.voids} voids>"

    def _mark_voids(self, void: np.ndarray) -> None:
        if self.voids == self.heights.size:
            raise TerrainError(f"{self.name}: every post is void (no-data, NaN or Inf): check the no-data value")
        if np.isinf(self.heights[void]).any():
            self.heights = np.where(void, np.float32(np.nan), self.heights)

    def _checked(self, low: float, high: float) -> Spacing:
        if max(-low, high) > MAX_HEIGHT_M:
            raise TerrainError(
                f"{self.name}: heights run from {low:.9g} to {high:.9g} m, beyond ±{MAX_HEIGHT_M:g}: "
                "name the no-data value (--nodata) or scale them (--z-scale)"
            )
        return float(low), float(high)

    def _follow_range(self, rows: slice, cols: slice) -> None:
        """Look again at the blocks that hold these posts, and at no others."""
        if self._lows is None or self._highs is None:
            self._lows, self._highs = (_of_blocks(of, self.heights) for of in (np.fmin, np.fmax))
        blocks = tuple(slice(s.start // RANGE_BLOCK, -(-s.stop // RANGE_BLOCK)) for s in (rows, cols))
        part = self.heights[tuple(slice(s.start * RANGE_BLOCK, s.stop * RANGE_BLOCK) for s in blocks)]
        self._lows[blocks], self._highs[blocks] = _of_blocks(np.fmin, part), _of_blocks(np.fmax, part)
        self.range_m = float(np.fmin.reduce(self._lows, None)), float(np.fmax.reduce(self._highs, None))


# --- Checks -----------------------------------------------------------------------------------------------------------


def _check_options(z_scale: float | None, z_offset_m: float | None, encoding: str, band: int | None) -> None:
    if z_scale is not None and (not math.isfinite(z_scale) or z_scale == 0):
        raise UsageError(f"z-scale must be a finite number other than 0, got {z_scale}")
    if z_offset_m is not None and not math.isfinite(z_offset_m):
        raise UsageError(f"z-offset must be a finite number of metres, got {z_offset_m}")
    if encoding not in ENCODINGS:
        raise UsageError(f"encoding must be one of {', '.join(ENCODINGS)}, got {encoding!r}")
    if band is not None and band < 1:
        raise UsageError(f"bands are counted from 1, got {band}")


def _check_size(rows: int, cols: int, name: str) -> None:
    if rows < 2 or cols < 2:
        raise TerrainError(f"{name}: has {cols} x {rows} posts: a heightmap needs at least 2 x 2")
    if rows * cols > MAX_POSTS or max(rows, cols) > MAX_SIDE:
        raise TerrainError(
            f"{name}: has {cols} x {rows} posts, more than the {MAX_POSTS} (16384 x 16384) held in memory: "
            "crop it or reduce it, for example with gdal_translate -outsize"
        )


def real_heights(heights: ArrayLike, name: str) -> np.ndarray:
    """Numbers of any real type as an array of whatever shape, NaN where a masked array hides them.

    Raises
    ------
    UsageError
        Complex numbers, words, rows of unlike length, and whatever else is no height.
    """
    try:
        values: np.ndarray = heights if isinstance(heights, np.ma.MaskedArray) else np.asarray(heights)
    except ValueError:
        raise UsageError(f"{name}: expected real heights, got rows of unlike length: {heights!r:.60}") from None
    if values.dtype.kind not in "iufb":
        raise UsageError(f"{name}: expected real heights, got {values.dtype}: {values.ravel()[:3]!s:.60}")
    return np.ma.filled(values.astype(np.float64), np.nan) if isinstance(values, np.ma.MaskedArray) else values


def _as_float32(heights: np.ndarray, name: str) -> np.ndarray:
    if heights.ndim != 2:
        raise TerrainError(f"{name}: expected heights of shape (rows, cols), got {heights.shape}")
    rows, cols = heights.shape
    _check_size(rows, cols, name)
    return _rounded(heights, name)


def _rounded(heights: np.ndarray, name: str) -> np.ndarray:
    """To float32; an error for what is finite and would not be."""
    with np.errstate(all="ignore"):
        rounded = np.ascontiguousarray(heights, np.float32)
    if np.can_cast(heights.dtype, np.float32):
        return rounded
    overflown = np.isinf(rounded) & np.isfinite(heights)
    if overflown.any():
        most = float(np.abs(heights[overflown]).max())
        raise TerrainError(f"{name}: heights up to ±{most:.9g} m, beyond ±{MAX_HEIGHT_M:g}: scale them")
    return rounded


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


def _of_blocks(of: np.ufunc, heights: np.ndarray) -> np.ndarray:
    """What a ufunc makes of each block of RANGE_BLOCK × RANGE_BLOCK posts."""
    for axis in (0, 1):
        heights = of.reduceat(heights, np.arange(0, heights.shape[axis], RANGE_BLOCK), axis)
    return heights


def _span_of(flags: np.ndarray, first: int) -> slice:
    """From the first to the last flag that is set, counted from `first`."""
    where = np.flatnonzero(flags)
    return slice(first + int(where[0]), first + int(where[-1]) + 1)


def _first_known(*choices: Any) -> Any:
    return next(choice for choice in choices if choice is not None)
