"""Rasters that GDAL reads, through rasterio (the [geo] extra): bands, place, unit, scale and no-data value.

A file may say "no data here" by a value (readers/values.py), or by opacity: a mask inside the file or beside it (.msk),
an alpha band, or a palette's transparent entries. Opacity is read as one more channel, 0 where a post is void.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.readers.georeference import Georeference, Grid, at_place, grid_through
from terrain_gl.readers.local import environment, open_layer
from terrain_gl.readers.raster import (
    INSTALL_GEO,
    MAX_CHANNELS,
    TRUST,
    Band,
    Blocks,
    Raster,
    damaged,
    gdal_failures,
    has_rasterio,
    listed,
    number_of,
    one_line,
    read_within,
    rows_at_once,
)
from terrain_gl.readers.refusals import step_for
from terrain_gl.readers.units import meaning_of

_BESIDE = re.compile(r"^(UNIT|Z_FACTOR|ZUNITS)(?:[ \t]*=|[ \t])[ \t]*([^\s=].*)$", re.IGNORECASE | re.MULTILINE)
_MOST_BYTES = 10_000


def open_gdal(path: str, name: str, trusted: bool = False, band: Band | None = None) -> Raster:
    """Open a raster with its tags: spacing, no-data value, scale, offset and unit of heights.

    Parameters
    ----------
    trusted : bool
        Let GDAL use all its drivers, which may read other files and the network.
    band : int or str, optional
        The band to read, from 1 or by its name; by default all, up to four.

    Raises
    ------
    TerrainError
        rasterio is missing, no allowed driver reads the file, or it holds no map.
    """

    def refused(reason: str, otherwise: str) -> TerrainError:
        with open(path, "rb") as file:
            return TerrainError(step_for(path, name, file.read(512), reason) or f"{name}: {otherwise}")

    if not has_rasterio():
        others = "is not PNG, TIFF, EXR, HDR, NPY or HGT: if it is another kind that GDAL reads"
        raise refused("", f"{others}, {INSTALL_GEO}")
    try:
        with environment(trusted):
            data, of_layer = open_layer(path, name, trusted, band)
            bands = bands_of(data, name, of_layer)
            blocks = read_within(data, _gdal_blocks(data, name, bands, partial(environment, trusted)))
            return replace(_raster(data, name, bands, blocks), has_windows=True)
    except gdal_failures() as error:
        unknown = "not recognized" in str(error)
        why = "not a format that is read here" if unknown else one_line(error)
        advice = f"; {TRUST}" if unknown and not trusted else ""
        kinds = "give PNG, TIFF, EXR, HDR, NPY, HGT"
        raise refused(str(error), f"is not a readable heightmap ({why}): {kinds}{advice}") from None


def open_dataset(data: Any, name: str) -> Raster:
    """Read the first band of a dataset that the caller has opened with rasterio, and closes later."""
    bands = bands_of(data, name, 1)
    return _raster(data, name, bands, _gdal_blocks(data, name, bands, partial(environment, True)))


def _raster(data: Any, name: str, bands: Bands, blocks: Blocks) -> Raster:
    first = bands.heights[0] - 1
    place, notes = place_of(data, name)
    about = attributes_of(data, first + 1)
    unit, factor = unit_beside(data)
    meaning = meaning_of(data.units[first] or unit, place.crs, about)
    raster = Raster(
        name,
        (data.height, data.width, bands.channels),
        np.dtype(data.dtypes[first]),
        blocks,
        has_alpha=bands.has_opacity,
        nodata=data.nodatavals[first] if bands.greys is None else None,  # with a palette, it is an index, not a height
        scale=data.scales[first] * meaning.metres * factor,
        offset_m=data.offsets[first] * meaning.metres,
        notes=notes + meaning.notes,
        bands=bands.names,
        meaning=meaning,
    )
    return at_place(raster, place, about.get("tifftag_imagedescription", ""))


def attributes_of(data: Any, band: int) -> dict[str, str]:
    """Attributes of a band by CF names: its own, or those that GDAL keeps for the file as variable#attribute."""
    try:
        own, whole = data.tags(band), data.tags()
        name = own.get("NETCDF_VARNAME") or data.descriptions[band - 1] or ""
    except UnicodeDecodeError:
        return {}
    of_file = {key.removeprefix(f"{name}#"): value for key, value in whole.items()}
    return {"name": name} | {key.lower(): value for key, value in (of_file | own).items() if "#" not in key}


def unit_beside(data: Any) -> tuple[str, float]:
    """The unit of heights, and a factor, in the .sgrd of SAGA and in old .prj of Arc/Info; "" and 1 if there are none.

    `data` is a dataset of rasterio.
    """
    found: dict[str, str] = {}
    if data.driver in ("SAGA", "AAIGrid"):
        for path in data.files:
            if path.lower().endswith((".sgrd", ".prj")):
                with open(path, encoding="utf-8", errors="replace") as file:
                    found |= {key.upper(): value.strip() for key, value in _BESIDE.findall(file.read(_MOST_BYTES))}
    unit = found.get("UNIT") or found.get("ZUNITS", "")
    factor = 1.0
    with suppress(ValueError, ZeroDivisionError):
        factor = float(found["Z_FACTOR"]) if "Z_FACTOR" in found else 1 / float(unit)  # Zunits 100: 100 for a metre
    return ("" if unit.lower() == "no" or unit[:1].isdigit() else unit), factor if 0 < factor < math.inf else 1.0


def place_of(data: Any, name: str) -> tuple[Georeference, tuple[str, ...]]:
    """The place of a dataset, from its transform or from ground control points on a grid; and notes for the user."""
    size = data.width, data.height
    try:
        crs = data.crs
    except gdal_failures():
        crs = None
    place = Georeference(Grid(*data.transform[:6]), crs, size)
    if not place.grid.tells_nothing:
        return place, ()
    points, crs = data.gcps
    if points:
        grid = grid_through([(p.col, p.row) for p in points], [(p.x, p.y) for p in points])
        if grid is None:
            on_none = f"is placed by {len(points)} ground control points, which are on no grid of posts"
            raise TerrainError(f"{name}: {on_none}: make one with gdalwarp {name} north-up.tif")
        return Georeference(grid, crs, size), ()
    ways = {"RPC": "-rpc", "GEOLOCATION": "-geoloc"}
    for way in ways.keys() & set(data.tag_namespaces()):
        return place, (f"its place is given by {way}: for a grid of posts, gdalwarp {ways[way]} {name} north-up.tif",)
    return place, ()


def _gdal_blocks(data: Any, name: str, bands: Bands, environment: Callable[[], AbstractContextManager[Any]]) -> Blocks:
    step = rows_at_once(data.width, unit=data.block_shapes[0][0])
    for row in range(0, data.height, step):
        rows = slice(row, min(row + step, data.height))
        with environment():
            pixels = read_pixels(data, name, bands, ((rows.start, rows.stop), (0, data.width)))
        yield rows, pixels


def read_pixels(data: Any, name: str, bands: Bands, window: Any, size: tuple[int, int] | None = None) -> np.ndarray:
    """Pixels of a window of a dataset: see `Bands.read`. `TerrainError` if the file is damaged."""
    try:
        return bands.read(data, window, size)
    except gdal_failures() as error:
        raise damaged(name, one_line(error)) from None


# --- Bands ------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Bands:
    """Which bands of a dataset are read, and how. Bands are counted from 1."""

    heights: tuple[int, ...]  # bands of heights or colours
    names: tuple[str, ...]  # the file's names of these bands; empty for bands without a name
    alphas: tuple[int, ...]  # bands of opacity
    has_mask: bool  # the first band has a mask besides its no-data value
    greys: np.ndarray | None  # grey level and opacity of each index of a palette: (n, 2) uint8

    @property
    def has_opacity(self) -> bool:
        """Whether the last channel is opacity."""
        return self.has_mask or bool(self.alphas) or self.greys is not None

    @property
    def channels(self) -> int:
        """Number of channels that `read` returns."""
        return len(self.heights) + self.has_opacity

    def read(self, data: Any, window: Any = None, size: tuple[int, int] | None = None) -> np.ndarray:
        """Pixels (rows, cols, channels) of a window; with `size`, only so many rows and columns, spread over it."""
        where = {"window": window, "out_shape": size}
        pixels = np.stack([data.read(band, **where) for band in self.heights], -1)
        if not self.has_opacity:
            return pixels
        opaque = np.ones(pixels.shape[:2], bool)
        if self.has_mask:
            opaque &= data.read_masks(self.heights[0], **where) != 0
        for band in self.alphas:
            opaque &= data.read(band, **where) != 0
        if self.greys is not None:
            entries = self.greys[np.minimum(pixels[..., 0], len(self.greys) - 1)]
            opaque &= entries[..., 1] != 0
            pixels = entries[..., :1]
        return np.concatenate([pixels, opaque[..., None].astype(pixels.dtype)], -1)


def bands_of(data: Any, name: str, band: Band | None) -> Bands:
    """Choose the bands of a rasterio dataset: the band with this number or name, or else all bands.

    `TerrainError` lists the bands, if there is no such band or if they hold no heights.
    """
    from rasterio.enums import ColorInterp

    alphas = tuple(i + 1 for i, meaning in enumerate(data.colorinterp) if meaning == ColorInterp.alpha)
    others = tuple(i for i in range(1, data.count + 1) if i not in alphas) or alphas
    names = tuple(_name(data, i + 1) for i in range(data.count))
    if band is not None:
        others = (number_of(band, names, name),)
    elif len(others) > MAX_CHANNELS:
        has = listed([names[i - 1] for i in others])
        raise TerrainError(f"{name}: {has}: say which holds the heights, as with --band 1")
    first = others[0] - 1
    if data.dtypes[first].startswith("complex"):
        raise TerrainError(f"{name}: holds complex numbers: convert it to one real height per post")
    alphas = tuple(alpha for alpha in alphas if alpha not in others)
    greys = _greys(data, others[0], name) if data.colorinterp[first] == ColorInterp.palette else None
    has_mask = _has_mask(data, first) or (greys is not None and data.nodatavals[first] is not None)
    return Bands(others, tuple(names[i - 1] for i in others), alphas, has_mask, greys)


def _name(data: Any, band: int) -> str:
    try:
        return data.descriptions[band - 1] or data.tags(band).get("NETCDF_VARNAME", "")
    except UnicodeDecodeError:
        return ""


def _has_mask(data: Any, first: int) -> bool:
    """Whether a band has a mask besides its no-data value and the alpha band, which are read in other ways."""
    from rasterio.enums import MaskFlags

    return set(data.mask_flag_enums[first]) not in (
        {MaskFlags.all_valid},
        {MaskFlags.nodata},
        {MaskFlags.per_dataset, MaskFlags.alpha},
    )


def _greys(data: Any, band: int, name: str) -> np.ndarray:
    """The grey levels of a palette; `TerrainError` if it has other colours."""
    palette: dict[int, Sequence[int]] = data.colormap(band)
    entries = np.zeros((max(palette, default=0) + 1, 4), np.uint8)
    for index, colour in palette.items():
        entries[index] = colour
    opaque = entries[entries[:, 3] > 0]
    if not (opaque[:, :1] == opaque[:, 1:3]).all():
        raise TerrainError(f"{name}: holds palette indices, not heights: convert it to one grey channel")
    return entries[:, [0, 3]]
