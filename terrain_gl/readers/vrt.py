"""GDAL's virtual rasters (.vrt): mosaics of local files, assembled by our own reader.

GDAL would open any file that a .vrt names, even on the network. This reader opens each source itself, and only files
beside or below the .vrt. It reads mosaics of gdalbuildvrt, and refuses others.
Format: https://gdal.org/drivers/raster/vrt.html
"""

from __future__ import annotations

import contextlib
import os
from collections import OrderedDict
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.readers.gdal import closed_environment, open_local
from terrain_gl.readers.georeference import Georeference, Grid, spacing_of, vertical_unit_m
from terrain_gl.readers.raster import (
    INSTALL_GEO,
    MAX_CHANNELS,
    TRUST,
    Blocks,
    Raster,
    damaged,
    gdal_failures,
    has_rasterio,
    north_up,
    one_line,
    rows_at_once,
)

LONGEST = 1 << 26  # bytes of XML
MOST_OPEN = 64  # sources at a time
_DTYPES = {
    **{"Byte": "u1", "Int8": "i1", "UInt16": "u2", "Int16": "i2", "UInt32": "u4", "Int32": "i4"},
    **{"UInt64": "u8", "Int64": "i8", "Float32": "f4", "Float64": "f8"},
}
_MAP = {"SRS", "GeoTransform", "Metadata", "OverviewList", "BlockXSize", "BlockYSize", "VRTRasterBand", "MaskBand"}
_BAND = {
    *("NoDataValue", "HideNoDataValue", "ColorInterp", "Description", "Metadata", "Overview", "Histograms"),
    *("SimpleSource", "ComplexSource", "UnitType", "Offset", "Scale"),
}
_SOURCE = {
    *("SourceFilename", "SourceBand", "SourceProperties", "SrcRect", "DstRect"),
    *("NODATA", "ScaleRatio", "ScaleOffset", "UseMaskBand"),
}


class Box(NamedTuple):
    """A rectangle in columns and rows."""

    x: float
    y: float
    width: float
    height: float


class Source(NamedTuple):
    """A part of a file and the part of the map that it covers.

    `is_mask`: the values are the mask of the band, 0 where the band has no data. `is_masked`: only posts with data are
    copied.
    """

    path: str
    band: int
    is_mask: bool
    is_masked: bool
    part: Box
    place: Box
    nodata: float | None
    ratio: float
    offset: float
    resampling: str


def open_vrt(path: str, name: str) -> Raster:
    """Open a mosaic.

    Raises
    ------
    TerrainError
        The file is not a mosaic of files beside or below it, or it has features that this reader does not support.
    """
    if not has_rasterio():
        raise TerrainError(f"{name}: is a .vrt: {INSTALL_GEO}")
    root = _parsed(path, name)
    try:
        return _raster(root, os.path.realpath(path), name)
    except (ValueError, KeyError, TypeError, OverflowError) as error:
        raise TerrainError(f"{name}: is not a whole .vrt ({one_line(error)}): make it again") from None


def sources_of(path: str, name: str) -> list[str]:
    """The files that a mosaic names."""
    bands = _parsed(path, name).findall("VRTRasterBand")
    names = [element for band in bands for element in band.iter("SourceFilename")]
    return [os.path.realpath(_named(element, os.path.dirname(os.path.realpath(path)))) for element in names]


def _parsed(path: str, name: str) -> ElementTree.Element:
    """The XML of a .vrt. Entities are refused: a few lines of them can expand to gigabytes."""
    if os.path.getsize(path) > LONGEST:
        raise TerrainError(f"{name}: is a .vrt of more than {LONGEST >> 20} MiB: convert it with gdal_translate")
    with open(path, "rb") as file:
        text = file.read()
    try:
        if b"<!" in text.replace(b"<!--", b""):
            raise ElementTree.ParseError("declarations and entities")
        return ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError) as error:
        raise TerrainError(f"{name}: is not a whole .vrt ({one_line(error)}): make it again") from None


def _raster(root: ElementTree.Element, path: str, name: str) -> Raster:
    _know(root, _MAP, name)
    rows, cols = int(root.attrib["rasterYSize"]), int(root.attrib["rasterXSize"])
    bands = root.findall("VRTRasterBand")
    if not 1 <= len(bands) <= MAX_CHANNELS or min(rows, cols) < 1:
        raise TerrainError(f"{name}: has {len(bands)} bands of {cols} x {rows} posts: expected 1 to {MAX_CHANNELS}")
    dtype = np.dtype(_DTYPES[bands[0].get("dataType", "Byte")])
    nodata = bands[0].findtext("NoDataValue")
    masks = root.findall("MaskBand/VRTRasterBand")
    sources = [_sources(band, path, name) for band in bands + masks]
    place = _georeference(root, (cols, rows))
    spacing_m, notes = spacing_of(place, name)
    unit_m, of_heights = vertical_unit_m(bands[0].findtext("UnitType"), place.crs)
    has_alpha = bool(masks) or (len(bands) > 1 and bands[-1].findtext("ColorInterp") == "Alpha")
    fill = 0.0 if nodata is None else float(nodata)
    fills = [fill] * len(bands) + [0.0] * len(masks)
    blocks = _blocks((rows, cols), dtype, fills, sources, name)
    return Raster(
        name,
        (rows, cols, len(sources)),
        dtype,
        north_up(blocks, rows) if place.grid.is_south_up else blocks,
        has_alpha,
        nodata=None if nodata is None else fill,
        spacing_m=spacing_m,
        scale=float(bands[0].findtext("Scale", "1")) * unit_m,
        offset_m=float(bands[0].findtext("Offset", "0")) * unit_m,
        notes=notes + of_heights,
        georeference=place.kept(),
    )


def _know(element: ElementTree.Element, known: set[str], name: str) -> None:
    """Refuse elements that this reader does not support; ignoring them could give wrong heights."""
    unknown = {child.tag for child in element} - known
    if element.get("subClass") or unknown:
        what = element.get("subClass") or ", ".join(sorted(unknown))
        raise TerrainError(f"{name}: is more than a mosaic of files ({what:.60}): {TRUST}, or use gdal_translate")


def _georeference(root: ElementTree.Element, size: tuple[int, int]) -> Georeference:
    c, a, b, f, d, e = (float(number) for number in root.findtext("GeoTransform", "0,1,0,0,0,1").split(","))
    return Georeference(Grid(a, b, c, d, e, f), _crs(root.findtext("SRS", "").strip()), size)


def _crs(text: str) -> Any:
    """A CRS from its number or its WKT; None for other text. GDAL would also accept network addresses."""
    import rasterio

    number = text.upper().removeprefix("EPSG:")
    with contextlib.suppress(*gdal_failures()), closed_environment():
        return rasterio.crs.CRS.from_epsg(int(number)) if number.isdigit() else rasterio.crs.CRS.from_wkt(text)
    return None


# --- Sources ----------------------------------------------------------------------------------------------------------


def _sources(band: ElementTree.Element, path: str, name: str) -> list[Source]:
    _know(band, _BAND, name)
    found = [child for child in band if child.tag in ("SimpleSource", "ComplexSource")]
    return [_source(element, os.path.dirname(path), name) for element in found]


def _source(element: ElementTree.Element, folder: str, name: str) -> Source:
    _know(element, _SOURCE, name)
    filename = element.find("SourceFilename")
    if filename is None:
        raise ValueError("a source without a file")
    path = _inside(_named(filename, folder), folder, name)
    nodata = element.findtext("NODATA") if element.tag == "ComplexSource" else None
    band = element.findtext("SourceBand", "1")
    part = _box(element.find("SrcRect"))
    place = _box(element.find("DstRect"))
    return Source(
        path,
        int(band.removeprefix("mask,")),
        band.startswith("mask,"),
        element.findtext("UseMaskBand", "").lower() in ("true", "1"),
        part,
        place,
        None if nodata is None else float(nodata),
        float(element.findtext("ScaleRatio", "1")),
        float(element.findtext("ScaleOffset", "0")),
        element.get("resampling", "nearest"),
    )


def _named(filename: ElementTree.Element, folder: str) -> str:
    """The path of a source, relative to the .vrt or to the working folder."""
    text = filename.text or ""
    return os.path.join(folder, text) if filename.get("relativeToVRT", "0") == "1" else os.path.abspath(text)


def _inside(path: str, folder: str, name: str) -> str:
    """The real path of a source, which must be a regular file beside or below the .vrt."""
    real = os.path.realpath(path)
    if os.path.commonpath([real, folder]) != folder or not os.path.isfile(real):
        raise TerrainError(
            f"{name}: names {path[-80:]!r}, which is not a file beside or below it: move it there, or {TRUST}"
        )
    return real


def _box(element: ElementTree.Element | None) -> Box:
    """A rectangle; numbers that differ from whole numbers only by rounding are rounded."""
    if element is None:
        raise ValueError("a source without SrcRect and DstRect")
    values = [float(element.attrib[key]) for key in ("xOff", "yOff", "xSize", "ySize")]
    if not all(map(np.isfinite, values)) or min(values[2:]) <= 0:
        raise ValueError(f"a source of {values[2]:g} x {values[3]:g} posts")
    return Box(*(round(value) if abs(value - round(value)) < 1e-3 else value for value in values))


# --- Pixels -----------------------------------------------------------------------------------------------------------


def _blocks(
    shape: tuple[int, int], dtype: np.dtype, fills: list[float], bands: list[list[Source]], name: str
) -> Blocks:
    rows, cols = shape
    step = rows_at_once(cols, unit=256)
    with _Files(name) as files:
        for row in range(0, rows, step):
            block = slice(row, min(row + step, rows))
            pixels = np.empty((block.stop - row, cols, len(bands)), dtype)
            pixels[:] = fills
            for channel, sources in enumerate(bands):
                for source in sources:
                    _paste(pixels[..., channel], row, source, files)
            yield block, pixels


def _paste(pixels: np.ndarray, row: int, source: Source, files: _Files) -> None:
    """Copy the part of a source that lies in the rows from `row` on."""
    place = source.place
    top, bottom = max(row, round(place.y)), min(row + len(pixels), round(place.y + place.height))
    left, right = max(0, round(place.x)), min(pixels.shape[1], round(place.x + place.width))
    if top >= bottom or left >= right:
        return
    target = Box(left, top, right - left, bottom - top)
    values = files.read(source, target, source.is_mask)
    if source.is_mask:
        values = values != 0
    scaled = values if (source.ratio, source.offset) == (1, 0) else values * source.ratio + source.offset
    keep = np.ones(values.shape, bool) if source.nodata is None else ~_equal(values, source.nodata)
    if source.is_masked:
        keep &= files.read(source, target, of_mask=True) != 0
    with np.errstate(all="ignore"):
        pixels[top - row : bottom - row, left:right][keep] = scaled[keep].astype(pixels.dtype)


def _equal(values: np.ndarray, nodata: float) -> np.ndarray:
    with np.errstate(all="ignore"):
        mark = values.dtype.type(nodata) if values.dtype.kind == "f" else nodata
    return np.isnan(values) if np.isnan(nodata) else values == mark


class _Files:
    """The datasets of the sources. The most recently used ones stay open."""

    def __init__(self, name: str) -> None:
        self.name = name
        self._open: OrderedDict[str, Any] = OrderedDict()

    def __enter__(self) -> _Files:
        return self

    def __exit__(self, *_: object) -> None:
        while self._open:
            self._open.popitem()[1].close()

    def read(self, source: Source, target: Box, of_mask: bool) -> np.ndarray:
        """Values, or the mask, of a part of the map that the source covers: (height, width)."""
        import rasterio

        across, down = source.part.width / source.place.width, source.part.height / source.place.height
        x = source.part.x + (target.x - source.place.x) * across
        y = source.part.y + (target.y - source.place.y) * down
        window = rasterio.windows.Window(x, y, target.width * across, target.height * down)
        try:
            with closed_environment():
                data = self._dataset(source.path)
                return (data.read_masks if of_mask else data.read)(
                    source.band,
                    window=window,
                    out_shape=(int(target.height), int(target.width)),
                    resampling=rasterio.enums.Resampling[source.resampling],
                )
        except IndexError:
            raise TerrainError(f"{self.name}: {os.path.basename(source.path)} has no band {source.band}") from None
        except gdal_failures() as error:
            raise damaged(self.name, f"{os.path.basename(source.path)}: {one_line(error)}") from None
        except KeyError:
            raise TerrainError(
                f"{self.name}: resampling {source.resampling!r} is unknown: use gdal_translate"
            ) from None

    def _dataset(self, path: str) -> Any:
        data = self._open.pop(path, None)
        if data is None:
            if len(self._open) >= MOST_OPEN:
                self._open.popitem(last=False)[1].close()
            data = open_local(path, self.name)
        self._open[path] = data
        return data
