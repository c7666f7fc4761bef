"""Files that GDAL opens, without the network and without other files of the machine.

Some drivers of GDAL follow a file to the network, or to other files. So a map is opened only with the drivers in
`DRIVERS`, which read the named file and its headers beside it. A virtual raster (.vrt) may name any file, with any
driver. So we read its XML first, and accept only mosaics of gdalbuildvrt whose sources are beside or below the .vrt.
GDAL then gets a copy of the XML, in which each source is an absolute path with the names of the drivers that may open
it. Format: https://gdal.org/drivers/raster/vrt.html
"""

from __future__ import annotations

import mmap
import os
import re
import stat
import warnings
from collections.abc import Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from typing import Any
from xml.etree import ElementTree

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.image import quiet_stderr
from terrain_gl.readers.raster import MOST_LISTED, TRUST, Band, damaged, one_line

DRIVERS = (
    *("GTiff", "HFA", "netCDF", "JPEG", "BMP", "PNG", "GIF", "JP2OpenJPEG", "TGA", "HF2", "SIGDEM"),
    *("AAIGrid", "GRASSASCIIGrid", "GSAG", "GSBG", "GS7BG", "NWT_GRD", "ZMap", "XYZ"),
    *("EHdr", "ENVI", "SAGA", "RST", "ROI_PAC", "PCRaster"),
    *("SRTMHGT", "DTED", "USGSDEM", "BT", "Terragen", "Leveller", "RMF"),
)
# These settings close all ways of GDAL to the network: a driver that opens a remote file gets an error.
OFFLINE = {
    "CPL_VSIL_CURL_ALLOWED_FILENAME": "/vsicurl/none",
    "CPL_VSIL_CURL_ALLOWED_EXTENSIONS": "{none}",
    "GDAL_DISABLE_READDIR_ON_OPEN": "FALSE",
    "GDAL_HTTP_MAX_RETRY": "0",
    "GDAL_HTTP_TIMEOUT": "1",
    "AWS_NO_SIGN_REQUEST": "YES",
    "CPL_AWS_AUTODETECT_EC2": "NO",
    "CPL_GCE_CHECK_LOCAL_FILES": "NO",
    "GDAL_VRT_ENABLE_PYTHON": "NO",
    "PROJ_NETWORK": "OFF",
    "OSR_DEFAULT_AXIS_MAPPING_STRATEGY": "TRADITIONAL_GIS_ORDER",
}
_ALWAYS = {
    "GDAL_CACHEMAX": 64 << 20,  # rasterio takes bytes; the default is a share of the machine's memory
    "VRT_NUM_THREADS": "1",  # with several threads, GDAL reads zeros where a source is damaged, without an error
    "GTIFF_REPORT_COMPD_CS": "YES",  # otherwise a GeoTIFF 1.0 has no vertical axis
    "GDAL_NETCDF_IGNORE_XY_AXIS_NAME_CHECKS": "YES",  # x and y are coordinates, also without attributes that say so
}
_HDF5 = b"\x89HDF\r\n\x1a\n"
_ERDAS = b"EHFA_HEADER_TAG"
_ERDAS_ELSEWHERE = b"ExternalRasterDMS"
_VRT = b"<VRTDataset"  # first bytes of a mosaic
_LONGEST = 1 << 26  # bytes of XML
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


def open_layer(path: str, name: str, trusted: bool, band: Band | None) -> tuple[Any, Band | None]:
    """Open a file, or the layer of it that `band` names; also returns the band of that layer.

    `TerrainError` lists the layers, if there are several and `band` names none of them.
    """
    data = _dataset(utf8(path, name)) if trusted else open_local(path, name)
    if data.count:
        return data, band
    layers = _layers(data)
    data.close()
    if not trusted:  # a name with other characters could be read as the name of another file
        layers = {layer: text for layer, text in layers.items() if re.fullmatch(r"[\w/.+-]+", layer)}
    drivers = None if trusted else DRIVERS
    if band in layers:
        return _dataset(layers[str(band)], drivers), None
    if len(layers) == 1:
        return _dataset(next(iter(layers.values())), drivers), band
    if not layers:
        raise TerrainError(f"{name}: holds no raster: extract one with gdal_translate")
    shown = ", ".join([*list(layers)[:MOST_LISTED], *(["…"] if len(layers) > MOST_LISTED else [])])
    raise TerrainError(f"{name}: holds the layers {shown}: name the one with heights, as --band {next(iter(layers))}")


def utf8(path: str | os.PathLike[str], name: str) -> str:
    """Return the absolute path for a library that takes only UTF-8 names."""
    try:
        os.fspath(path).encode("utf-8")
    except UnicodeEncodeError:
        raise TerrainError(f"{name}: its name is not valid UTF-8: rename the file") from None
    return os.path.abspath(path)


def _layers(data: Any) -> dict[str, str]:
    """GDAL's name for each layer of a file, by the layer's name. Bounds of cells are left out if others remain."""
    layers = {text.rpartition(":")[2]: text for text in data.subdatasets}
    about = " ".join(data.tags(ns="SUBDATASETS").values())
    thin = set(re.findall(r"\[[\dx]*x[1-4]\] ([\w/.+-]+)", about))  # as in "[100x2] lat_bnds (64-bit floating-point)"
    return {name: text for name, text in layers.items() if name not in thin} or layers


def open_local(path: str, name: str) -> Any:
    """Open a regular file with the allowed drivers, as a rasterio dataset.

    Raises
    ------
    TerrainError
        A file beside it with the same name and another ending is a pipe, a device or a link to another folder; or the
        file is of a kind that may name other files as its data.
    rasterio.errors.RasterioError
        No allowed driver reads it.
    """
    is_mosaic = _is_mosaic(path)
    text, sources = _safe_mosaic(path, name) if is_mosaic else (utf8(path, name), [path])
    _check_companions([path, *sources], name)
    for source in sources:
        _check_own_data(source, name)
    return _dataset(text, ("VRT",) if is_mosaic else DRIVERS)


def _dataset(text: str, drivers: Sequence[str] | None = None) -> Any:
    """Open a dataset by GDAL's name for it; with `drivers`, only these may open it, without the network."""
    import rasterio

    with environment(trusted=drivers is None), warnings.catch_warnings():
        warnings.simplefilter("ignore", rasterio.errors.NotGeoreferencedWarning)
        # rasterio.open takes one driver; the class that it makes takes a list
        return rasterio.io.DatasetReader(text, driver=drivers and list(drivers), sharing=False)


def environment(trusted: bool) -> AbstractContextManager[Any]:
    """The settings in which GDAL runs, open for a file that is trusted."""
    import rasterio

    return rasterio.Env(**_ALWAYS) if trusted else closed_environment()


@contextmanager
def closed_environment() -> Iterator[None]:
    """Run GDAL without the network, without credentials, and without its own messages."""
    import rasterio
    from rasterio.session import DummySession

    with rasterio.Env(session=DummySession(), **_ALWAYS, **OFFLINE), quiet_stderr():
        yield


def _check_companions(files: Iterable[str], name: str) -> None:
    """Refuse headers beside the files of a map that are pipes or devices, or that link to another folder."""
    stems: dict[str, set[str]] = {}
    for path in files:
        folder, file = os.path.split(os.path.realpath(path))
        stems.setdefault(folder, set()).add(os.path.splitext(file)[0].lower())
    for folder in stems:
        with os.scandir(folder) as entries:
            for entry in entries:
                words = entry.name.lower().split(".")
                starts = {".".join(words[:n]) for n in range(1, len(words))}
                if starts & stems[folder] and not _is_companion(entry, folder):
                    beside = os.fsencode(entry.name).decode("utf-8", "replace")
                    raise TerrainError(
                        f"{name}: {beside} beside it is a pipe, a device or a link to another folder: move it away"
                    )


def _check_own_data(path: str, name: str) -> None:
    """Refuse kinds of files that can name any other file as their data."""
    if not os.path.getsize(path):
        raise damaged(name, f"{os.path.basename(path)} is empty")
    with open(path, "rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        if data[: len(_HDF5)] == _HDF5:
            raise TerrainError(f"{name}: is HDF5 (netCDF-4), whose data may be in any other file: {TRUST}")
        if data[: len(_ERDAS)] == _ERDAS and data.find(_ERDAS_ELSEWHERE) >= 0:
            raise TerrainError(f"{name}: is an ERDAS image whose data are in another file: {TRUST}")


def _is_companion(entry: os.DirEntry[str], folder: str) -> bool:
    if entry.is_dir():
        return True
    try:
        regular = stat.S_ISREG(os.stat(entry.path).st_mode)
    except OSError:  # a broken link: nothing can be read from it
        return True
    return regular and (not entry.is_symlink() or os.path.dirname(os.path.realpath(entry.path)) == folder)


# --- Mosaics ----------------------------------------------------------------------------------------------------------


def _safe_mosaic(path: str, name: str) -> tuple[str, list[str]]:
    """A copy of a mosaic's XML with which GDAL opens its sources by the allowed drivers alone; and the sources.

    `TerrainError` if the file is not a mosaic of files beside or below it.
    """
    root = _parsed(path, name)
    _reduce(root, name)
    folder = os.path.dirname(os.path.realpath(path))
    sources = []
    for element in root.iter("SourceFilename"):
        sources.append(_inside(_named(element, folder), folder, name))
        element.attrib = {"relativeToVRT": "0"}
        element.text = f"vrt://{sources[-1]}?if={','.join(DRIVERS)}"
    return ElementTree.tostring(root, "unicode"), sorted(set(sources))


def sources_of(path: str, name: str) -> list[str]:
    """The files that a mosaic names, for heights and for masks; none for other files."""
    if not _is_mosaic(path):
        return []
    folder = os.path.dirname(os.path.realpath(path))
    return [os.path.realpath(_named(each, folder)) for each in _parsed(path, name).iter("SourceFilename")]


def _is_mosaic(path: str) -> bool:
    with open(path, "rb") as file:
        return file.read(64).lstrip().startswith(_VRT)


def _parsed(path: str, name: str) -> ElementTree.Element:
    """The XML of a .vrt. Entities are refused: a few lines of them can expand to gigabytes."""
    if os.path.getsize(path) > _LONGEST:
        raise TerrainError(f"{name}: is a .vrt of more than {_LONGEST >> 20} MiB: convert it with gdal_translate")
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
