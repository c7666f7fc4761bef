"""Rasters of other libraries: xarray's DataArray and Dataset, with or without rioxarray, and rasterio's datasets."""

from collections.abc import Hashable
from dataclasses import replace
from typing import Any

import numpy as np

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.readers.gdal import open_dataset
from terrain_gl.readers.georeference import DEGREES, EVEN, Georeference, Grid, at_place
from terrain_gl.readers.raster import Blocks, Raster, gdal_failures, has_rasterio
from terrain_gl.readers.units import meaning_of

_ACROSS = ("x", "lon", "longitude", "easting", "projection_x_coordinate")
_DOWN = ("y", "lat", "latitude", "northing", "projection_y_coordinate")


def raster_of(source: Any, name: str) -> Raster | None:
    """An object of xarray or a rasterio dataset as a raster; None for any other object. Lazy arrays are computed."""
    if _has(source, "read", "transform", "nodatavals", "descriptions"):
        return open_dataset(source, name)
    if is_labelled(source):
        array, raster = lazy_array(source, name)
        return replace(raster, blocks=_blocks(np.asarray(array.values)))
    return None


def is_labelled(source: object) -> bool:
    """Whether this is a DataArray or a Dataset of xarray."""
    return _has(source, "dims", "coords", "attrs", "transpose")


def _has(source: object, *names: str) -> bool:
    return all(hasattr(source, each) for each in names)


def _only_variable(dataset: Any, name: str) -> Any:
    """The only variable of a Dataset that is a map, as a DataArray with the coordinate system that it names."""
    layers = {
        key: array
        for key, array in dataset.data_vars.items()
        if None not in (_dimension(array, _ACROSS), _dimension(array, _DOWN)) and array.dtype.kind in "iuf"
    }
    if len(layers) != 1:
        every = ", ".join(map(str, layers or dataset.data_vars)) or "none"
        raise TerrainError(
            f"{name}: is a Dataset with the variables {every}: give the one with heights, as dataset['z']"
        )
    array = next(iter(layers.values()))
    mapping = array.attrs.get("grid_mapping", array.encoding.get("grid_mapping"))
    return array.assign_coords({mapping: dataset[mapping]}) if mapping in dataset.data_vars else array


def lazy_array(array: Any, name: str) -> tuple[Any, Raster]:
    """A DataArray (or the only map of a Dataset) with rows from north to south, and its description as a `Raster`.

    No value is computed. `TerrainError` if there are more than two dimensions, or posts are not evenly spaced.
    """
    if _has(array, "data_vars"):
        array = _only_variable(array, name)
    across, down = _dimension(array, _ACROSS), _dimension(array, _DOWN)
    extra = {dim: n for dim, n in zip(array.dims, array.shape, strict=True) if dim not in (across, down)}
    if None in (across, down) or any(n != 1 for n in extra.values()):
        dims = ", ".join(f"{dim}: {n}" for dim, n in zip(array.dims, array.shape, strict=True))
        raise TerrainError(
            f"{name}: expected dimensions y and x, got ({dims}): select one layer, as with .isel(band=0)"
        )
    array = array.isel(dict.fromkeys(extra, 0)).transpose(down, across)
    x, y = (_coordinates(array, dim, name) for dim in (across, down))
    if x is not None and x[-1] < x[0]:
        x = x[::-1]
        array = array.isel({across: slice(None, None, -1)})
    grid = _grid(x, y)
    if grid.is_south_up:
        array = array.isel({down: slice(None, None, -1)})
    rows, cols = array.shape
    place = Georeference(grid, _crs_of(array, across), (cols, rows))
    told = {str(key).lower(): str(value) for key, value in array.attrs.items()}
    meaning = meaning_of(told.get("units"), place.crs, {"name": str(array.name or ""), **told})
    # attributes describe the values as they are stored (CF conventions)
    nodata = array.attrs.get("_FillValue", array.attrs.get("missing_value"))
    scale, offset = (float(array.attrs.get(key, usual)) for key, usual in (("scale_factor", 1), ("add_offset", 0)))
    notes = meaning.notes
    if grid.tells_nothing and any(
        each.ndim == 2 and set(each.dims) == {across, down} for each in array.coords.values()
    ):
        notes += (
            "its coordinates are curvilinear: for a grid of posts, write netCDF and gdalwarp -geoloc (--spacing)",
        )
    raster = Raster(
        name,
        (rows, cols, 1),
        array.dtype,
        nodata=None if nodata is None else float(np.ravel(nodata)[0]),
        scale=scale * meaning.metres,
        offset_m=offset * meaning.metres,
        notes=notes,
        meaning=meaning,
    )
    return array, at_place(raster, place)


def _blocks(heights: np.ndarray) -> Blocks:
    yield slice(0, len(heights)), heights[..., None]


def _dimension(array: Any, names: tuple[str, ...]) -> Hashable | None:
    """The dimension with one of these names; in a 2-D array without such names, the last two in order."""
    for dim in array.dims:
        if str(dim).lower() in names:
            return dim
    unnamed = array.ndim == 2 and not any(str(dim).lower() in _ACROSS + _DOWN for dim in array.dims)
    return array.dims[names is _ACROSS] if unnamed else None


def _coordinates(array: Any, dim: Hashable, name: str) -> np.ndarray | None:
    """Coordinates of the posts along a dimension, if the array has them."""
    if dim not in array.coords or len(array[dim]) < 2:
        return None
    values = np.asarray(array[dim].values)
    if values.dtype.kind not in "iuf":
        return None
    rounding = np.spacing(np.abs(values).max()) if values.dtype.kind == "f" else 0.0  # large for float32
    values = values.astype(np.float64)
    steps = np.diff(values)
    if not np.abs(steps - steps.mean()).max() <= EVEN * abs(steps.mean()) + float(rounding):
        raise TerrainError(f"{name}: its posts are not evenly spaced along {dim}: resample it first")
    return values


def _grid(x: np.ndarray | None, y: np.ndarray | None) -> Grid:
    """The transform from coordinates of posts, which are the centres of pixels; the default if there are none."""
    if x is None or y is None:
        return Grid()
    a, e = (float(values[-1] - values[0]) / (len(values) - 1) for values in (x, y))
    return Grid(a, 0.0, float(x[0]) - a / 2, 0.0, e, float(y[0]) - e / 2)


def _crs_of(array: Any, across: Hashable) -> Any:
    """A rasterio CRS from rioxarray or CF conventions, else from the names of the dimensions."""
    text = next(
        (
            str(told)
            for coordinate in array.coords.values()
            if (told := coordinate.attrs.get("crs_wkt") or coordinate.attrs.get("spatial_ref"))
        ),
        array.attrs.get("crs"),
    )
    if text is None and str(across).lower().startswith("lon"):
        text = DEGREES
    if text is None or not has_rasterio():
        return None
    import rasterio

    try:
        return rasterio.crs.CRS.from_user_input(text)
    except gdal_failures():
        return None
