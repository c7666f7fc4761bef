"""Pictures of the ground, and values on it: laid onto the place of a map, or over it from edge to edge.

Both are read a few rows at a time, at the resolution that shading uses.
"""

import math
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ..basics.exceptions import TerrainError
from ..basics.inputs import check_input
from ..readers import open_raster
from ..readers.georeference import Georeference, Grid
from ..readers.images import open_oiio
from ..readers.local import closed_environment, open_local
from ..readers.place import Place
from ..readers.plausible import undeclared_voids, without
from ..readers.raster import gdal_failures, has_rasterio, one_line, rows_at_once
from ..readers.values import read_heights
from .ramps import Ramp, Range, ramp_for
from .tones import Tones, range_of, tones_of, with_opacity

MOST_SIDE = 8192  # texels of the texture that shading samples
MOST_PIXELS = 1 << 29  # most pixels of a file
_SAMPLES = 1024  # most pixels a side of the copy in which we look for the highest value, and for marks of voids
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
        (rows, cols, 3), 0 to 1, of a picture that covers the map from edge to edge; or (rows, cols, 4) of a picture
        with coordinates, or with opacity. The last channel is the share of a texel that the picture covers; the colours
        are multiplied by it. Of a picture of more than `most_side` pixels a side, a texel is a mean of pixels.

    Raises
    ------
    TerrainError
        The file is not a readable picture, has too many pixels or values that are not finite, or lies off the map.
    """
    name = check_input(path, "name a picture")
    if onto is not None:
        with _placed(path, name) as picture:
            if picture is not None:
                return _laid(picture, name, onto, most_side, asked)
    return _edge_to_edge(path, name, most_side, asked)


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


def read_values(path: str, onto: Georeference | None = None) -> Draped:
    """Values of a raster of one band, placed as `read_ground` places pictures; voids are left out.

    Voids are found as in maps: by NaN, the no-data value, a mask or an alpha band, and values that many programs write.

    Raises
    ------
    TerrainError
        The file is not a readable raster of one band, or it has no values; or the raster lies off the map.
    """
    name = check_input(path, "name a raster")
    sums = None
    if onto is not None:
        with _placed(path, name) as raster:
            if raster is not None:
                if _bands(raster) != 1:
                    raise TerrainError(f"{name}: has {raster.count} bands, but values need one: use --material")
                scaled = partial(_weighted, scale=raster.scales[0], offset=raster.offsets[0])
                sums = _resampled(raster, name, onto, MOST_SIDE, (1,), scaled, voids=_undeclared(raster))
    if sums is None:
        sums = _whole(path, name)
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


def _whole(path: str, name: str) -> np.ndarray:
    """Sums of values of a raster that covers the map from edge to edge."""
    raster = open_raster(path)
    if raster.colours != 1:
        raster.blocks.close()
        raise TerrainError(f"{name}: has {raster.colours} channels, but values need one: use --material")
    values = read_heights(raster)
    values = without(values, undeclared_voids(values, (1.0, 0.0))[0])[..., None]
    rows, cols, _ = values.shape
    n = -(-max(rows, cols) // MOST_SIDE)
    sums = np.zeros((-(-rows // n), -(-cols // n), 2), "f4")
    added_to(sums, 0, n, _weighted(values, np.ones_like(values)))
    return mean_of(sums, rows, cols, n, "f4")


def look_into(path: str, asked: Range | None, is_picture: bool) -> tuple[bool, tuple[str, ...]]:
    """Whether a file holds one band of floats or signed integers, which are values; and notes on colours made of it.

    There are no notes on values unless it `is_picture` all the same, nor on a file that its reader will refuse.
    """
    has_values = False
    notes: tuple[str, ...] = ()
    with suppress(TerrainError, *(gdal_failures() if has_rasterio() else ())):
        name = check_input(path, "name a picture")
        with _placed(path, name) as picture:
            if picture is not None:
                has_values = _bands(picture) == 1 and np.dtype(picture.dtypes[0]).kind in "fi"
            else:
                with suppress(TerrainError):  # a picture may be no map
                    raster = open_raster(path)
                    raster.blocks.close()
                    has_values = raster.colours == 1 and raster.dtype.kind in "fi"
            if is_picture or not has_values:
                tones = tones_of(picture, name, asked, _SAMPLES) if picture else _tones_in(path, name, asked)
                notes = tones.notes
    return has_values, notes


def is_albedo(path: str) -> bool:
    """Whether all values of a raster of one band are from 0 to 1: then they may be albedos."""
    draped = read_values(path)
    there = draped.values[draped.covered > 0]
    return bool(there.min() >= 0 and there.max() <= 1)


@contextmanager
def _placed(path: str, name: str) -> Iterator[Any]:
    """Yield the rasterio dataset of a picture with coordinates; None for other pictures, and without rasterio."""
    if not has_rasterio():
        yield None
        return
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


def _edge_to_edge(path: str, name: str, most_side: int, asked: Range | None) -> np.ndarray:
    """Linear albedo of a picture that covers the map from edge to edge; with opacity, colours times it, and opacity."""
    tones = _tones_in(path, name, asked)
    raster = open_oiio(path, name)
    rows, cols, _ = raster.shape
    n = -(-max(rows, cols) // most_side)
    has_alpha = raster.has_alpha and tones.has_opacity
    channels = 4 if has_alpha else 3
    albedo = np.zeros((-(-rows // n), -(-cols // n), channels), "f4" if n > 1 else "f2")
    with np.errstate(under="ignore"):  # the smallest half float is 6e-8
        for where, pixels in raster.blocks:
            if not np.isfinite(pixels).all():
                raise TerrainError(f"{name}: has values that are not finite: correct the picture")
            colour = tones.linear(pixels[..., : len(tones.bands)])
            if has_alpha:
                share = share_of(pixels[..., -1:])
                colour = np.concatenate([np.broadcast_to(colour * share, (*share.shape[:2], 3)), share], -1)
            if n == 1:
                albedo[where] = colour
            else:
                added_to(albedo, where.start, n, colour)
        return albedo if n == 1 else mean_of(albedo, rows, cols, n)


def _tones_in(path: str, name: str, asked: Range | None) -> Tones:
    """How the values of a picture without coordinates become colours."""
    raster = open_oiio(path, name)
    rows, cols, _ = raster.shape
    if rows * cols > MOST_PIXELS:
        raise TerrainError(f"{name}: has {cols} x {rows} pixels, more than {MOST_PIXELS:,}: reduce the picture")
    bands = (1, 2, 3) if raster.colours >= 3 else (1,)
    values = np.zeros(0, raster.dtype)
    declared = None
    step = max(1, max(rows, cols) // _SAMPLES)
    with closing(raster.blocks):
        if not asked and raster.dtype != np.uint8:
            values = np.concatenate([p[::step, ::step, : len(bands)].ravel() for _, p in raster.blocks])
        elif raster.dtype == np.uint8 and raster.has_alpha and name.lower().endswith((".tif", ".tiff")):
            declared = np.concatenate([p[::step, ::step, -1].ravel() for _, p in raster.blocks])
    found, notes = range_of(values, None, asked)  # OpenImageIO scales 12 bits to 16
    return with_opacity(Tones(bands, found, None, notes), declared)


def share_of(opacity: np.ndarray, most: float | None = None) -> np.ndarray:
    """Opacity from 0 to 1; `most` is opaque, by default the largest number of the type.

    Floats have no common largest value, so every float except 0 counts as opaque.
    """
    if opacity.dtype.kind == "f":
        return (opacity != 0).astype("f4")
    return np.minimum(opacity.astype("f4") / np.float32(most or np.iinfo(opacity.dtype).max), np.float32(1))


def added_to(sums: np.ndarray, first: int, n: int, colour: np.ndarray) -> None:
    """Add rows of pixels, from row `first` on, to the sums over boxes of n × n pixels."""
    across = np.add.reduceat(colour, np.arange(0, colour.shape[1], n), 1)
    np.add.at(sums, (first + np.arange(len(colour))) // n, across)


def mean_of(sums: np.ndarray, rows: int, cols: int, n: int, dtype: str = "f2") -> np.ndarray:
    """Divide by the number of pixels in each square; squares at the far edges have fewer pixels."""
    high, wide = (np.minimum(n, size - np.arange(0, size, n)).astype("f4") for size in (rows, cols))
    return (sums / (high[:, None] * wide)[..., None]).astype(dtype)
