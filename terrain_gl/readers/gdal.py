"""TIFF with its tags, and every other raster that GDAL opens, through rasterio (the [geo] extra)."""

from __future__ import annotations

import re
import warnings
from typing import Any

import numpy as np

from terrain_gl.exceptions import TerrainError
from terrain_gl.readers.geodesy import WGS84, metres_per_degree
from terrain_gl.readers.raster import (
    INSTALL_GEO,
    MAX_CHANNELS,
    Blocks,
    Raster,
    Spacing,
    damaged,
    has_rasterio,
    one_line,
    rows_at_once,
    utf8,
)


def open_gdal(path: str, name: str) -> Raster:
    """Open whatever GDAL opens, with its spacing and no-data tags; without rasterio, say how to get it."""
    if not has_rasterio():
        raise TerrainError(
            f"{name}: is not PNG, TIFF, EXR, HDR, NPY or HGT: if it is another kind that GDAL reads, {INSTALL_GEO}"
        )
    import rasterio

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", rasterio.errors.NotGeoreferencedWarning)
            data = rasterio.open(utf8(path, name))
            _check_bands(data, name)
            spacing_m = _gdal_spacing(data, name)
    except rasterio.errors.RasterioError as error:
        reason = "not a format that GDAL knows" if "not recognized" in str(error) else one_line(error)
        raise TerrainError(
            f"{name}: is not a readable heightmap ({reason}): give PNG, TIFF, EXR, HDR, NPY, HGT"
        ) from None
    shape = (data.height, data.width, data.count)
    has_alpha = data.count > 1 and data.colorinterp[-1] == rasterio.enums.ColorInterp.alpha
    return Raster(name, shape, np.dtype(data.dtypes[0]), _gdal_blocks(data, name), has_alpha, data.nodata, spacing_m)


def _check_bands(data: Any, name: str) -> None:
    import rasterio

    if data.count == 0:
        raise TerrainError(f"{name}: holds several layers and no raster of its own: extract one with gdal_translate")
    if data.count > MAX_CHANNELS:
        raise TerrainError(f"{name}: has {data.count} bands, not one of heights: extract it with gdal_translate -b")
    if data.dtypes[0].startswith("complex"):
        raise TerrainError(f"{name}: holds complex numbers: convert it to one real height per post")
    if data.colorinterp[0] == rasterio.enums.ColorInterp.palette:
        raise TerrainError(f"{name}: holds palette indices, not heights: convert it to one grey channel")


def _gdal_blocks(data: Any, name: str) -> Blocks:
    import rasterio

    step = rows_at_once(data.width, unit=data.block_shapes[0][0])
    with data, rasterio.Env(GDAL_CACHEMAX=64):  # MB; the default is a share of the machine's memory
        for row in range(0, data.height, step):
            rows = slice(row, min(row + step, data.height))
            try:
                pixels = data.read(window=((rows.start, rows.stop), (0, data.width)))
            except rasterio.errors.RasterioError as error:
                raise damaged(name, one_line(error.__cause__ or error)) from None
            yield rows, np.moveaxis(pixels, 0, -1)


def _gdal_spacing(data: Any, name: str) -> Spacing | None:
    """Metres between posts from the geotransform: degrees at the map's middle latitude, else linear units."""
    grid = data.transform
    if grid.is_identity:
        return None
    if grid.b or grid.d or grid.a < 0 or grid.e > 0:
        raise TerrainError(f"{name}: is not stored north up: turn it first with gdalwarp {name} north-up.tif")
    if data.crs is None:
        return grid.a, -grid.e
    if data.crs.is_geographic:
        east, north = metres_per_degree(grid.f + grid.e * data.height / 2, *_ellipsoid(data.crs))
        return grid.a * east, -grid.e * north
    unit = data.crs.linear_units_factor[1]
    return grid.a * unit, -grid.e * unit


def _ellipsoid(crs: Any) -> tuple[float, float]:
    """Semi-major axis in metres and inverse flattening (0 for a sphere): not every map is of the Earth."""
    found = re.search(r'SPHEROID\["[^"]*",([\d.]+),([\d.]+)', crs.to_wkt(version="WKT1_GDAL"))
    return (float(found[1]), float(found[2])) if found else WGS84
