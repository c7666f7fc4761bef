"""GDAL's virtual rasters (.vrt): mosaics of local files.

GDAL would open any file that a .vrt names, with any driver, even on the network. So we read the XML first, and accept
only mosaics of gdalbuildvrt whose sources are beside or below the .vrt. GDAL then gets a copy of the XML, in which each
source is an absolute path with the names of the drivers that may open it.
Format: https://gdal.org/drivers/raster/vrt.html
"""

import os
from collections.abc import Sequence
from xml.etree import ElementTree

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.readers.raster import TRUST, one_line, utf8

VRT = b"<VRTDataset"  # first bytes of a mosaic
LONGEST = 1 << 26  # bytes of XML
# Elements that GDAL gets, and elements that it does not need. Others could change heights or name other files.
_KEPT = {
    "VRTDataset": {"SRS", "GeoTransform", "VRTRasterBand", "MaskBand"},
    "MaskBand": {"VRTRasterBand"},
    "VRTRasterBand": {
        *("NoDataValue", "ColorInterp", "Description", "UnitType", "Offset", "Scale", "SimpleSource", "ComplexSource"),
    },
    "SimpleSource": {"SourceFilename", "SourceBand", "SourceProperties", "SrcRect", "DstRect"},
    "ComplexSource": {
        *("SourceFilename", "SourceBand", "SourceProperties", "SrcRect", "DstRect"),
        *("NODATA", "ScaleRatio", "ScaleOffset", "UseMaskBand"),
    },
}
_DROPPED = {"Metadata", "OverviewList", "Overview", "BlockXSize", "BlockYSize", "HideNoDataValue", "Histograms"}


def safe_mosaic(path: str, name: str, drivers: Sequence[str]) -> tuple[str, list[str]]:
    """A copy of a mosaic's XML with which GDAL opens its sources by these drivers alone; and the sources.

    `TerrainError` if the file is not a mosaic of files beside or below it.
    """
    root = _parsed(path, name)
    _reduce(root, name)
    folder = os.path.dirname(os.path.realpath(path))
    sources = []
    for element in root.iter("SourceFilename"):
        sources.append(_inside(_named(element, folder), folder, name))
        element.attrib = {"relativeToVRT": "0"}
        element.text = f"vrt://{sources[-1]}?if={','.join(drivers)}"
    return ElementTree.tostring(root, "unicode"), sorted(set(sources))


def sources_of(path: str, name: str) -> list[str]:
    """The files that a mosaic names, for heights and for masks."""
    folder = os.path.dirname(os.path.realpath(path))
    return [os.path.realpath(_named(each, folder)) for each in _parsed(path, name).iter("SourceFilename")]


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


def _reduce(element: ElementTree.Element, name: str) -> None:
    """Drop what a mosaic does not need; refuse unknown elements, because without them heights could be wrong."""
    known = _KEPT.get(element.tag, set())
    unknown = {child.tag for child in element} - known - _DROPPED
    if element.get("subClass") or unknown:
        what = element.get("subClass") or ", ".join(sorted(unknown))
        raise TerrainError(f"{name}: is more than a mosaic of files ({what:.60}): {TRUST}, or use gdal_translate")
    for child in list(element):
        if child.tag in known:
            _reduce(child, name)
        else:
            element.remove(child)


def _named(filename: ElementTree.Element, folder: str) -> str:
    """The path of a source, relative to the .vrt or to the working folder."""
    text = filename.text or ""
    return os.path.join(folder, text) if filename.get("relativeToVRT", "0") == "1" else os.path.abspath(text)


def _inside(path: str, folder: str, name: str) -> str:
    """The real path of a source: a regular file beside or below the .vrt. After a ? GDAL would read options."""
    real = utf8(os.path.realpath(path), name)
    if os.path.commonpath([real, folder]) != folder or not os.path.isfile(real) or "?" in real:
        raise TerrainError(
            f"{name}: names {path[-80:]!r}, which is not a file beside or below it: move it there, or {TRUST}"
        )
    return real
