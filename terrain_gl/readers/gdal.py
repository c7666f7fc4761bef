"""TIFF with its tags, and the other local rasters that GDAL reads, through rasterio (the [geo] extra).

Some drivers of GDAL follow a file to the network, or to other files of the machine. So a map is opened only with the
drivers in `DRIVERS`, which read the named file and its headers beside it.
"""

from __future__ import annotations

import mmap
import os
import re
import stat
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from functools import partial
from typing import Any

import numpy as np

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.image import quiet_stderr
from terrain_gl.readers.bands import Bands, bands_of
from terrain_gl.readers.description import as_described, unit_beside
from terrain_gl.readers.georeference import Georeference, Grid, at_place, grid_through
from terrain_gl.readers.raster import (
    INSTALL_GEO,
    MOST_LISTED,
    TRUST,
    Band,
    Blocks,
    Raster,
    damaged,
    gdal_failures,
    has_rasterio,
    one_line,
    read_within,
    rows_at_once,
    utf8,
)
from terrain_gl.readers.refusals import step_for
from terrain_gl.readers.units import meaning_of
from terrain_gl.readers.vrt import VRT, safe_mosaic

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
    if not has_rasterio():
        if refusal := step_for(path, name, _head(path)):
            raise TerrainError(refusal)
        others = "is not PNG, TIFF, EXR, HDR, NPY or HGT: if it is another kind that GDAL reads"
        raise TerrainError(f"{name}: {others}, {INSTALL_GEO}")
    try:
        with _environment(trusted):
            data, of_layer = open_layer(path, name, trusted, band)
            bands = bands_of(data, name, of_layer)
            blocks = read_within(data, _gdal_blocks(data, name, bands, partial(_environment, trusted)))
            return _raster(data, name, bands, blocks)
    except gdal_failures() as error:
        if refusal := step_for(path, name, _head(path), str(error)):
            raise TerrainError(refusal) from None
        unknown = "not recognized" in str(error)
        reason = "not a format that is read here" if unknown else one_line(error)
        advice = f"; {TRUST}" if unknown and not trusted else ""
        kinds = "give PNG, TIFF, EXR, HDR, NPY, HGT"
        raise TerrainError(f"{name}: is not a readable heightmap ({reason}): {kinds}{advice}") from None


def _head(path: str) -> bytes:
    with open(path, "rb") as file:
        return file.read(512)


def open_dataset(data: Any, name: str) -> Raster:
    """Read the first band of a dataset that the caller has opened with rasterio, and closes later."""
    bands = bands_of(data, name, 1)
    return _raster(data, name, bands, _gdal_blocks(data, name, bands, partial(_environment, True)))


def _raster(data: Any, name: str, bands: Bands, blocks: Blocks) -> Raster:
    first = bands.heights[0] - 1
    place, notes = place_of(data, name)
    unit, factor = unit_beside(data)
    meaning = meaning_of(data.units[first] or unit, place.crs, attributes_of(data, first + 1))
    about = ""
    with suppress(UnicodeDecodeError):
        about = str(data.tags().get("TIFFTAG_IMAGEDESCRIPTION", ""))
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
    return at_place(as_described(raster, about), place)


def attributes_of(data: Any, band: int) -> dict[str, str]:
    """Attributes of a band by CF names: its own, or those that GDAL keeps for the file as variable#attribute."""
    try:
        own, whole = data.tags(band), data.tags()
        name = own.get("NETCDF_VARNAME") or data.descriptions[band - 1] or ""
    except UnicodeDecodeError:
        return {}
    of_file = {key.removeprefix(f"{name}#"): value for key, value in whole.items()}
    return {"name": name} | {key.lower(): value for key, value in (of_file | own).items() if "#" not in key}


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
    with open(path, "rb") as file:
        is_mosaic = file.read(64).lstrip().startswith(VRT)
    text, sources = safe_mosaic(path, name, DRIVERS) if is_mosaic else (utf8(path, name), [path])
    _check_companions([path, *sources], name)
    for source in sources:
        _check_own_data(source, name)
    return _dataset(text, ("VRT",) if is_mosaic else DRIVERS)


def _dataset(text: str, drivers: Sequence[str] | None = None) -> Any:
    """Open a dataset by GDAL's name for it; with `drivers`, only these may open it, without the network."""
    import rasterio

    with _environment(trusted=drivers is None), warnings.catch_warnings():
        warnings.simplefilter("ignore", rasterio.errors.NotGeoreferencedWarning)
        # rasterio.open takes one driver; the class that it makes takes a list
        return rasterio.io.DatasetReader(text, driver=drivers and list(drivers), sharing=False)


def _environment(trusted: bool) -> AbstractContextManager[Any]:
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
