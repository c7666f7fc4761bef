"""Write rasters through GDAL."""

import numpy as np
import pytest


def write_raster(path, values, grid=(10, 0, 500_000, 0, -10, 5_000_000), crs="EPSG:32633", driver="GTiff", **more):
    """Write values (rows, cols) or (bands, rows, cols) on a grid, the six numbers of its transform, or None; the path.

    All bands have the same scale, offset and unit, each has tags of its own. Other options are GDAL's.
    """
    rasterio = pytest.importorskip("rasterio", reason="the extra [geo] is not installed")
    values = np.reshape(values, (-1, *np.shape(values)[-2:]))
    count, rows, cols = values.shape
    of_all = {name: [more.pop(name[:-1])] * count for name in ("scales", "offsets", "units") if name[:-1] in more}
    of_each = {name: more.pop(name) for name in ("colorinterp", "descriptions") if name in more}
    tags, mask, palette = (more.pop(name, None) for name in ("tags", "mask", "palette"))
    profile = {"count": count, "height": rows, "width": cols, "dtype": values.dtype.name, "crs": crs}
    if grid is not None:
        profile["transform"] = rasterio.Affine(*grid)
    with rasterio.open(path, "w", driver=driver, **profile, **more) as file:
        if palette:
            file.write_colormap(1, palette)
        file.write(values)
        for name, given in (of_all | of_each).items():
            setattr(file, name, given)
        for band, of_band in enumerate(tags or (), 1):
            file.update_tags(band, **of_band)
        if mask is not None:
            file.write_mask(mask)
    return path


def spaced(step, west=500_000, north=5_000_000):
    """The grid of square cells whose north-western corner is given."""
    return step, 0, west, 0, -step, north
