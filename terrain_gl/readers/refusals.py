"""What a file is if it is no grid of heights, and the next step for it."""

import os
import re

from terrain_gl.basics.inputs import is_store
from terrain_gl.readers.tiles import example_of_tiles

_SHAPE = b"\0\0\x27\x0a"
_SQLITE = b"SQLite format 3"
# the first bytes of a file, what it is, and what to do; NAME and STEM are those of the file
_KINDS: tuple[tuple[bytes, str, str], ...] = (
    (rb"LASF", "is a point cloud", "make a grid of it: pdal translate NAME STEM.tif --writers.gdal.resolution=1"),
    (
        rb"ASTM-E57|# \.PCD|ply\r?\n",
        "is a point cloud or a mesh",
        "make a grid of its points with pdal or CloudCompare",
    ),
    (
        rb"glTF|solid |v -?\d|# ?[Bb]lender|# .*OBJ",
        "is a mesh",
        "make a grid of its vertices with pdal or CloudCompare",
    ),
    (re.escape(_SHAPE), "is a shapefile, lines or points", "for --overlay: ogr2ogr -f GeoJSON STEM.geojson NAME"),
    (
        re.escape(_SQLITE),
        "is a database, as GeoPackage and MBTiles are",
        "lines for --overlay: ogr2ogr -f GeoJSON STEM.geojson NAME; a raster in it: gdal_translate NAME STEM.tif",
    ),
    (rb"PMTiles", "is an archive of tiles", "take the tiles out with pmtiles extract, then terrain-gl build"),
    (
        rb'\s*\{\s*"(type|features|crs|name|geometry|bbox)"',
        "is GeoJSON, lines or points",
        "draw it over a map with --overlay",
    ),
    (rb"(\xef\xbb\xbf)?\s*<(\?xml[^>]*>\s*<)?(gpx|kml)", "holds lines or points", "draw it over a map with --overlay"),
    (rb"GRIB|\x0e\x03\x13\x01", "is GRIB or HDF4", "if you trust it, give --trust, or gdal_translate NAME STEM.tif"),
    (rb"msid|ecw|\x65\x02", "is MrSID or ECW", "make a TIFF of it with a GDAL that has this driver: gdal_translate"),
    (rb"AC10\d\d|  0\r?\nSECTION", "is a CAD drawing", "export its heights as a grid, or its points for pdal"),
    (rb"%PDF", "is a PDF", "download the map as GeoTIFF; a GeoPDF: gdal_translate NAME STEM.tif"),
    (rb"Rar!|7z\xbc\xaf|\x1f\x9d|BZh|\xfd7zXZ|\x28\xb5\x2f\xfd", "is packed", "unpack it first"),
    (rb"(\xef\xbb\xbf)?\s*<(!doctype )?html", "is a web page, not the file", "download it again"),
    (rb"version https://git-lfs", "is a pointer of Git LFS, not the file", "run git lfs pull"),
)
_BESIDE = (".hdr", ".prj", ".tfw", ".pgw", ".wld", ".aux.xml", ".ovr", ".sgrd", ".rsc", ".msk", ".dbf", ".shx", ".cpg")


def step_for(path: str, name: str, head: bytes, reason: str = "") -> str | None:
    """What a file is and the next step, for a file that is no map; None if this is not known.

    `reason` is what GDAL says of it.
    """
    stem = os.path.splitext(name)[0]
    for ending in _BESIDE:
        is_beside = path.lower().endswith(ending) and not head.startswith(b"#?")  # Radiance pictures are .hdr, too
        if is_beside and (whose := _described(path[: -len(ending)], path)):
            return f"{name}: is beside the data: open {whose}"
    for first, what, step in _KINDS:
        if re.match(first, head, re.IGNORECASE):
            return f"{name}: {what}, not a grid of heights: {step.replace('NAME', name).replace('STEM', stem)}"
    if re.search("Ungridded|step[XY]", reason) or path.lower().endswith((".xyz", ".csv", ".txt", ".pts")):
        return f"{name}: holds points on no grid: make a grid of them with gdal_grid or pdal"
    return None


def step_for_archive(name: str, members: list[str], maps: list[str]) -> str:
    """What to do with an archive that does not hold exactly one map."""
    stem = os.path.splitext(name)[0]
    if maps:
        shown = ", ".join(maps[:3]) + ", …" * (len(maps) > 3)
        return f"{name}: holds {len(maps)} maps ({shown}): unpack it, and open one, or terrain-gl build all of them"
    endings = {os.path.splitext(member.rstrip("/"))[1].lower() for member in members}
    if ".shp" in endings:
        step = f"for --overlay: ogr2ogr -f GeoJSON {stem}.geojson /vsizip/{name}"
        return f"{name}: holds a shapefile, lines or points, not a grid of heights: {step}"
    if endings & {".las", ".laz"}:
        return f"{name}: holds point clouds: unpack it, and make a grid of them with pdal"
    if endings & {".adf", ".gdb", ".gdbtable"}:
        return f"{name}: holds a grid or database of ESRI: unpack it, then gdal_translate FOLDER {stem}.tif"
    shown = ", ".join(members[:3]) + ", …" * (len(members) > 3) or "nothing"
    return f"{name}: holds no map that is read here, but {shown}"


def step_for_folder(path: str, name: str) -> str:
    """What to do with a folder that was given for a file."""
    if is_store(path):
        return f"{path}: is a store, not a file: open it with terrain_gl.store.StoredMap"
    entries = os.listdir(path)
    if any(entry.lower().endswith((".adf", ".gdbtable")) for entry in entries):
        return f"{name}: is a grid or database of ESRI, a folder: gdal_translate {name} {name.rstrip('/')}.tif"
    tiles = [entry for entry in sorted(entries) if entry.lower().endswith((".tif", ".tiff", ".hgt", ".png", ".asc"))]
    if tiles:
        return f"{name}: is a folder of files: name one, or terrain-gl build {os.path.join(name, tiles[0])} …"
    if pattern := example_of_tiles(path):
        return f"{name}: is a folder of tiles: name one, or terrain-gl build {pattern}"
    return f"{name}: is a folder: name a heightmap file"


def _described(stem: str, path: str) -> str | None:
    """The data file that a header stands beside."""
    folder, start = os.path.split(stem)
    endings = (".flt", ".bil", ".bip", ".bsq", ".img", ".dat", ".sdat", ".asc", ".tif", ".tiff", ".png", ".jpg", ".shp")
    for entry in sorted(os.listdir(folder or ".")):
        first, ending = os.path.splitext(entry)
        if entry != os.path.basename(path) and (entry == start or (first == start and ending.lower() in endings)):
            return entry
    return None
