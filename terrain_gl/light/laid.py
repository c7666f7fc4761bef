"""Pictures of the ground with coordinates, resampled to the place of a map with coordinates."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ..basics.exceptions import TerrainError
from ..basics.inputs import check_input
from ..readers import open_raster
from ..readers.georeference import Georeference, Grid
from ..readers.local import closed_environment, open_local
from ..readers.place import Place
from ..readers.plausible import undeclared_voids, without
from ..readers.raster import gdal_failures, has_rasterio, one_line, rows_at_once
from ..readers.values import read_heights
from .albedo import MOST_SIDE, added_to, mean_of, read_albedo, share_of, tones_in
from .ramps import Ramp, Range, ramp_for
from .tones import tones_of

_SAMPLES = 1024  # most pixels a side of the copy in which we look for values that mark voids
_OPAQUE_32 = 255.0  # alpha that GDAL makes beside bands of 32 bits
_SAME_PLANE = "EPSG:3857"  # for both coordinate systems if neither is known; any other would do the same


def read_ground(
    path: str, onto: Georeference | None = None, most_side: int = MOST_SIDE, asked: Range | None = None
) -> np.ndarray:
    """Linear albedo of a picture of the ground, half floats.

    Parameters
    ----------
    onto
        Where the map lies.
    asked
        Values of black and white; by default those of `Tones`.

    Returns
    -------
    albedo
        (rows, cols, 3) of a picture that covers the map from edge to edge, as `read_albedo` reads it; or
        (rows, cols, 4) of a picture with coordinates, or with opacity. The last channel is the share of a texel that
        the picture covers; the colours are multiplied by it.

    Raises
    ------
    TerrainError
        The same errors as `read_albedo`; or the picture lies off the map.
    """
    if onto is not None and has_rasterio():
        name = check_input(path, "name a picture")
        with _placed(path, name) as picture:
            if picture is not None:
                return _laid(picture, name, onto, most_side, asked)
    return read_albedo(path, most_side, asked)


class Draped(NamedTuple):
    """Values on the ground.

    Attributes
    ----------
    values
        (rows, cols) float32.
    covered
        (rows, cols) float32, the share of a texel that has values.
    """

    values: np.ndarray
    covered: np.ndarray

    def ramp(self, name: str, asked: Range | None) -> Ramp:
        """A ramp for the values: see `ramp_for`."""
        there = self.values[self.covered > 0]
        return ramp_for(float(there.min()), float(there.max()), name, asked)

    def coloured(self, ramp: Ramp) -> np.ndarray:
        """(rows, cols, 4) half floats, as `read_ground` returns them."""
        colours = ramp.colours(self.values) * self.covered[..., None]
        return np.concatenate([colours, self.covered[..., None]], -1).astype("f2")


def read_values(path: str, onto: Georeference | None = None, most_side: int = MOST_SIDE) -> Draped:
    """Values of a raster of one band, placed as `read_ground` places pictures; voids are left out.

    Voids are found as in maps: by NaN, the no-data value, a mask or an alpha band, and values that many programs write.

    Raises
    ------
    TerrainError
        The file is not a readable raster of one band, or it has no values; or the raster lies off the map.
    """
    name = check_input(path, "name a raster")
    sums = None
    if onto is not None and has_rasterio():
        with _placed(path, name) as raster:
            if raster is not None:
                if _bands(raster) != 1:
                    raise TerrainError(f"{name}: has {raster.count} bands, but values need one: use --material")
                scaled = partial(_weighted, scale=raster.scales[0], offset=raster.offsets[0])
                sums = _resampled(raster, name, onto, most_side, (1,), scaled, voids=_undeclared(raster))
    if sums is None:
        sums = _whole(path, name, most_side)
    covered = sums[..., 1]
    if not covered.any():
        raise TerrainError(f"{name}: has no values on the map")
    return Draped(sums[..., 0] / np.maximum(covered, 1e-6), covered)


def _bands(raster: Any) -> int:
    """Number of bands of a rasterio dataset without opacity."""
    import rasterio

    return int(raster.count - raster.colorinterp.count(rasterio.enums.ColorInterp.alpha))


def _undeclared(raster: Any) -> dict[str, float]:
    """A value that marks voids although the raster does not say so, as arguments of WarpedVRT."""
    size = tuple(min(side, _SAMPLES) for side in raster.shape)
    marks, _ = undeclared_voids(raster.read(1, out_shape=size, masked=True).astype("f4").filled(np.nan), (1.0, 0.0))
    return {"src_nodata": marks[0], "nodata": marks[0]} if marks else {}


def _weighted(pixels: np.ndarray, covered: np.ndarray, scale: float = 1.0, offset: float = 0.0) -> np.ndarray:
    """(rows, cols, 2) float32 values times their coverage, and the coverage."""
    values = (pixels[..., :1] * np.float64(scale) + offset).astype("f4")
    covered = covered * np.isfinite(values)
    return np.concatenate([np.where(covered > 0, values, 0) * covered, covered], -1)


def _whole(path: str, name: str, most_side: int) -> np.ndarray:
    """Sums of values of a raster that covers the map from edge to edge."""
    raster = open_raster(path)
    if raster.colours != 1:
        raster.blocks.close()
        raise TerrainError(f"{name}: has {raster.colours} channels, but values need one: use --material")
    values = read_heights(raster)
    values = without(values, undeclared_voids(values, (1.0, 0.0))[0])[..., None]
    rows, cols, _ = values.shape
    n = -(-max(rows, cols) // most_side)
    sums = np.zeros((-(-rows // n), -(-cols // n), 2), "f4")
    added_to(sums, 0, n, _weighted(values, np.ones_like(values)))
    return mean_of(sums, rows, cols, n, "f4")


def holds_values(path: str) -> bool:
    """Whether a file holds one band of floats or signed integers: these are values, not colours."""
    try:
        name = check_input(path, "name a picture")
        if has_rasterio():
            with _placed(path, name) as raster:
                if raster is not None:
                    return _bands(raster) == 1 and np.dtype(raster.dtypes[0]).kind in "fi"
        raster = open_raster(path)
        raster.blocks.close()
        return bool(raster.colours == 1 and np.dtype(raster.dtype).kind in "fi")
    except TerrainError:  # the function that reads the file will report the error
        return False


def picture_notes(path: str, asked: Range | None) -> tuple[str, ...]:
    """Notes on how the values of a picture become colours; none if it cannot be read, which its reader reports."""
    with suppress(TerrainError, *(gdal_failures() if has_rasterio() else ())):
        name = check_input(path, "name a picture")
        if has_rasterio():
            with _placed(path, name) as picture:
                if picture is not None:
                    return tones_of(picture, name, asked, _SAMPLES).notes
        return tones_in(path, asked).notes
    return ()


def is_albedo(path: str) -> bool:
    """Whether all values of a raster of one band are from 0 to 1: then they may be albedos."""
    draped = read_values(path)
    there = draped.values[draped.covered > 0]
    return bool(there.min() >= 0 and there.max() <= 1)


@contextmanager
def _placed(path: str, name: str) -> Iterator[Any]:
    """Yield the rasterio dataset of a picture with coordinates; None for other pictures."""
    try:
        with closed_environment():
            data = open_local(path, name)
    except gdal_failures():  # GDAL does not open it, so it has no coordinates
        yield None
        return
    with data:
        yield None if Grid(*data.transform[:6]).tells_nothing else data


def _laid(picture: Any, name: str, onto: Georeference, most_side: int, asked: Range | None) -> np.ndarray:
    """A picture resampled to the map, (rows, cols, 4). It is read a few rows at a time."""
    tones = tones_of(picture, name, asked, _SAMPLES)

    def weighted(pixels: np.ndarray, covered: np.ndarray) -> np.ndarray:
        covered = covered * tones.opaque(pixels)
        colour = np.where(covered > 0, tones.linear(pixels), 0) * covered
        return np.concatenate([np.broadcast_to(colour, (*covered.shape[:2], 3)), covered], -1)

    with picture if tones.has_opacity else _without_opacity(picture) as read:
        laid = _resampled(read, name, onto, most_side, tones.bands, weighted, tones.palette is not None)
    with np.errstate(under="ignore"):
        return laid.astype("f2")


def _without_opacity(picture: Any) -> Any:
    """The rasterio dataset of a picture's bands without the one that it declares as opacity."""
    import rasterio

    bands = ",".join(str(i + 1) for i, each in enumerate(picture.colorinterp) if each.name != "alpha")
    with closed_environment():
        return rasterio.open(f"vrt://{picture.name}?bands={bands}")


def _resampled(
    picture: Any,
    name: str,
    onto: Georeference,
    most_side: int,
    bands: tuple[int, ...],
    weighted: Callable[..., np.ndarray],
    has_palette: bool = False,
    voids: dict[str, float] | None = None,
) -> np.ndarray:
    """Means over texels of the results of `weighted`, a function of pixels and of their covered shares."""
    import rasterio
    from rasterio.vrt import WarpedVRT

    opacities = [i for i, each in enumerate(picture.colorinterp, 1) if each == rasterio.enums.ColorInterp.alpha]
    has_alpha = bool(opacities)
    most = _most_opaque(picture) if has_alpha else _OPAQUE_32 if picture.dtypes[0] in ("uint32", "int32") else None
    by_value = bool(voids) or (picture.nodata is not None and not has_alpha)
    by_alpha = not by_value and not has_alpha  # GDAL makes an alpha band of a mask, and of the picture's outline
    try:
        with closed_environment(), np.errstate(under="ignore"):
            how = _target(picture, name, onto, most_side)
            cols = how["width"]
            rows = how["height"]
            n = how.pop("n")
            sums: np.ndarray | None = None
            between = rasterio.enums.Resampling.nearest if has_palette else rasterio.enums.Resampling.bilinear
            with WarpedVRT(picture, resampling=between, add_alpha=by_alpha, **how, **(voids or {})) as laid:
                step = rows_at_once(cols)
                for first in range(0, rows, step):
                    window = (first, min(first + step, rows)), (0, cols)
                    # rasterio's mask ignores an alpha band that is made of a mask
                    alpha = opacities[0] if has_alpha else laid.count
                    opacity = laid.dataset_mask(window=window) if by_value else laid.read(alpha, window=window)
                    covered = share_of(opacity[..., None], most)
                    pixels = np.moveaxis(laid.read(list(bands), window=window), 0, -1)
                    part = weighted(pixels, covered)
                    if sums is None:
                        sums = np.zeros((-(-rows // n), -(-cols // n), part.shape[-1]), "f4")
                    added_to(sums, first, n, part)
            assert sums is not None
            return mean_of(sums, rows, cols, n, "f4")
    except gdal_failures() as error:
        raise TerrainError(f"{name}: cannot be resampled to the map ({one_line(error)})") from None


def _most_opaque(picture: Any) -> float | None:
    """The value of opaque pixels: in 16 bits, it may be 4095 or 255."""
    import rasterio

    band = picture.colorinterp.index(rasterio.enums.ColorInterp.alpha) + 1
    if picture.dtypes[band - 1] == "uint8":
        return None
    return float(picture.read(band, out_shape=tuple(min(side, _SAMPLES) for side in picture.shape)).max())


def _target(picture: Any, name: str, onto: Georeference, most_side: int) -> dict[str, Any]:
    """Arguments of WarpedVRT: the map's extent at the picture's resolution, with n × n pixels for each texel."""
    import rasterio
    from rasterio.warp import transform_bounds

    # if only one of the two coordinate systems is known, it is taken for both
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
