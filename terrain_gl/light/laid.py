"""Pictures of the ground with coordinates, resampled to the place of a map with coordinates."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from ..basics.exceptions import TerrainError
from ..basics.inputs import check_input
from ..readers.gdal import closed_environment, open_local
from ..readers.georeference import Georeference, Grid
from ..readers.place import Place
from ..readers.raster import gdal_failures, has_rasterio, one_line, rows_at_once
from .albedo import MOST_SIDE, added_to, linear_albedo, mean_of, read_albedo

_SAME_PLANE = "EPSG:3857"  # taken for both systems if neither is known; any other would give the same result


def read_ground(path: str, onto: Georeference | None = None, most_side: int = MOST_SIDE) -> np.ndarray:
    """Linear albedo of a picture of the ground, half floats.

    Parameters
    ----------
    onto
        Where the map lies.

    Returns
    -------
    albedo
        (rows, cols, 3) of a picture that covers the map from edge to edge, as `read_albedo` reads it; or
        (rows, cols, 4) of a picture with coordinates. The last channel is the share of a texel that the picture
        covers; the colours are multiplied by it.

    Raises
    ------
    TerrainError
        The same errors as `read_albedo`; or the picture lies off the map.
    """
    if onto is not None and has_rasterio():
        check_input(path, "name a picture")
        name = os.fsencode(path).decode("utf-8", "replace")
        with _placed(path, name) as picture:
            if picture is not None:
                return _laid(picture, name, onto, most_side)
    return read_albedo(path, most_side)


@contextmanager
def _placed(path: str, name: str) -> Iterator[Any]:
    """Yield the rasterio dataset of a picture with coordinates; None for other pictures."""
    try:
        with closed_environment():
            data = open_local(path, name)
    except gdal_failures():  # a kind without coordinates
        yield None
        return
    with data:
        yield None if Grid(*data.transform[:6]).tells_nothing else data


def _laid(picture: Any, name: str, onto: Georeference, most_side: int) -> np.ndarray:
    """(rows, cols, 4) of a picture, resampled to the map, read a few rows at a time."""
    import rasterio
    from rasterio.vrt import WarpedVRT

    if rasterio.enums.ColorInterp.palette in picture.colorinterp:
        raise TerrainError(f"{name}: holds palette indices: turn it into colours with gdal_translate -expand rgb")
    has_mask = picture.nodata is not None or rasterio.enums.ColorInterp.alpha in picture.colorinterp
    bands = [1, 2, 3] if picture.count >= 3 else [1]
    try:
        with closed_environment(), np.errstate(under="ignore"):
            how = _target(picture, name, onto, most_side)
            cols = how["width"]
            rows = how["height"]
            n = how.pop("n")
            albedo = np.zeros((-(-rows // n), -(-cols // n), 4), "f4")
            bilinear = rasterio.enums.Resampling.bilinear
            with WarpedVRT(picture, resampling=bilinear, add_alpha=not has_mask, **how) as laid:
                step = rows_at_once(cols)
                for first in range(0, rows, step):
                    window = (first, min(first + step, rows)), (0, cols)
                    covered = laid.dataset_mask(window=window)[..., None].astype("f4") / 255
                    pixels = np.moveaxis(laid.read(bands, window=window), 0, -1)
                    colour = np.broadcast_to(linear_albedo(pixels, name) * covered, (*covered.shape[:2], 3))
                    added_to(albedo, first, n, np.concatenate([colour, covered], -1))
            return mean_of(albedo, rows, cols, n)
    except gdal_failures() as error:
        raise TerrainError(f"{name}: cannot be resampled to the map ({one_line(error.__cause__ or error)})") from None


def _target(picture: Any, name: str, onto: Georeference, most_side: int) -> dict[str, Any]:
    """Arguments of WarpedVRT: the map's extent at the picture's resolution, n × n pixels a texel."""
    import rasterio
    from rasterio.warp import transform_bounds

    # if only one system is known, it is taken for both
    known = picture.crs or onto.crs or _SAME_PLANE, onto.crs or picture.crs or _SAME_PLANE
    source, target = (rasterio.crs.CRS.from_user_input(crs) for crs in known)
    grid = onto.grid
    cols, rows = onto.size
    width, height = cols * grid.a, rows * -grid.e
    west, south, east, north = transform_bounds(source, target, *picture.bounds)
    middle = (west + east) / 2  # longitudes are the same modulo 360 degrees
    grid = grid._replace(c=grid.c + middle - float(Place(onto, (1.0, 1.0)).nearest_turn(np.array([middle]))[0]))
    if not (west < grid.c + width and east > grid.c and south < grid.f and north > grid.f - height):
        raise TerrainError(f"{name}: lies off the map: choose another picture")
    pixels = width / (east - west) * picture.width, height / (north - south) * picture.height
    n = max(1, math.ceil(max(pixels) / most_side))
    across, down = (max(1, min(most_side * n, round(size))) for size in pixels)
    transform = rasterio.Affine(width / across, 0, grid.c, 0, -height / down, grid.f)
    return {"src_crs": source, "crs": target, "transform": transform, "width": across, "height": down, "n": n}
