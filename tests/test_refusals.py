"""Files that are no grid of heights: a line says what they are, and the next step. Texts are read in any encoding."""

import gzip
import json
import struct
import zipfile

import numpy as np
import pytest

from terrain_gl import Heightmap
from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.readers.georeference import Georeference, Grid
from terrain_gl.readers.windows import open_windows
from terrain_gl.renderer.overlay import read_overlay

rasterio = pytest.importorskip("rasterio")
xarray = pytest.importorskip("xarray")

LAS = b"LASF" + bytes(20) + b"\1\2" + bytes(201)
SHAPE = struct.pack(">7i", 9994, 0, 0, 0, 0, 0, 50) + struct.pack("<2i8d", 1000, 3, *[0.0] * 8)
SCATTERED = "".join(f"{500000 + 7.3 * i:.2f} {4900000 + 3.1 * (i * i % 17):.2f} {-i}\n" for i in range(30)).encode()
GEOJSON = b'{"type": "FeatureCollection", "features": []}'
KML = b'<?xml version="1.0"?><kml xmlns="http://www.opengis.net/kml/2.2"/>'
# the content of a file, and words of its line
FILES = {
    "cloud.las": (LAS, "point cloud.*pdal translate .*cloud.las .*cloud.tif"),
    "cloud.laz": (LAS, "point cloud.*pdal translate .*cloud.laz"),
    "cloud.e57": (b"ASTM-E57" + bytes(40), "point cloud.*pdal"),
    "mesh.ply": (b"ply\nformat ascii 1.0\n", "mesh.*pdal"),
    "mesh.glb": (b"glTF\2\0\0\0", "is a mesh"),
    "roads.shp": (SHAPE, "shapefile.*ogr2ogr -f GeoJSON .*roads.geojson .*roads.shp"),
    "land.gpkg": (b"SQLite format 3\0" + bytes(80), "gdal_translate .*land.gpkg .*land.tif"),
    "roads.geojson": (GEOJSON, "--overlay"),
    "zones.kml": (KML, "--overlay"),
    "soundings.xyz": (SCATTERED, "points on no grid.*gdal_grid"),
    "survey.csv": (b"x,y,z\n" + SCATTERED.replace(b" ", b","), "points on no grid.*gdal_grid"),
    "model.dxf": (b"  0\nSECTION\n", "CAD"),
    "sheet.pdf": (b"%PDF-1.7\n", "gdal_translate"),
    "map.7z": (b"7z\xbc\xaf\x27\x1c", "unpack it first"),
    "dem.tif": (b"<!DOCTYPE html><html>Sign in</html>", "web page"),
    "big.tif": (b"version https://git-lfs.github.com/spec/v1\n", "git lfs pull"),
    "forecast.grib2": (b"GRIB\0\0\0\2", "--trust"),
}


@pytest.mark.parametrize("name", FILES)
def test_a_line_names_the_next_step(folder, name):
    content, words = FILES[name]
    (folder / name).write_bytes(content)
    with pytest.raises(TerrainError, match=words) as refused:
        Heightmap.open(name)
    assert ("--trust" in str(refused.value)) == ("--trust" in words) and str(refused.value).startswith(f"{name}: ")


# members of a .zip, and words of its line
ARCHIVES = {
    "a shapefile": (("roads.shp", "roads.dbf"), "ogr2ogr -f GeoJSON a.geojson /vsizip/a.zip"),
    "point clouds": (("a.laz", "b.laz"), "pdal"),
    "several maps": (("a.tif", "b.tif"), r"holds 2 maps \(a.tif, b.tif\).*build"),
    "a grid of ESRI": (("grid/w001001.adf",), "gdal_translate FOLDER a.tif"),
    "others": (("readme.txt",), "holds no map.*readme.txt"),
}


@pytest.mark.parametrize("name", ARCHIVES)
def test_archives_without_one_map_say_what_they_hold(folder, name):
    members, words = ARCHIVES[name]
    with zipfile.ZipFile("a.zip", "w") as archive:
        for member in members:
            archive.writestr(member, "x")
    with pytest.raises(TerrainError, match=words):
        Heightmap.open("a.zip")


def test_folders_and_headers_name_the_data(folder):
    (folder / "grid").mkdir()
    (folder / "grid/hdr.adf").write_bytes(b"x")
    with pytest.raises(TerrainError, match=r"gdal_translate grid grid\.tif"):
        Heightmap.open("grid")
    (folder / "tiles").mkdir()
    (folder / "tiles/n1.tif").write_bytes(b"x")
    with pytest.raises(TerrainError, match="build tiles/n1.tif"):
        Heightmap.open("tiles")
    (folder / "dem.flt").write_bytes(bytes(400))
    (folder / "dem.hdr").write_text("ncols 10\nnrows 10\n")
    with pytest.raises(TerrainError, match=r"open dem\.flt"):
        Heightmap.open("dem.hdr")


# --- Texts ------------------------------------------------------------------------------------------------------------

HEIGHTS = np.round(400 + 10 * np.add.outer(np.arange(5.0), np.arange(6.0)), 1)
HEAD = "ncols 6\nnrows 5\nxllcorner 500000\nyllcorner 4900000\ncellsize 10\nNODATA_value -9999\n"
GRID = HEAD + "\n".join(" ".join(f"{z:.1f}" for z in row) for row in HEIGHTS) + "\n"
POINTS = "".join(f"{500005 + 10 * x} {4900045 - 10 * y} {HEIGHTS[y, x]:.1f}\n" for y in range(5) for x in range(6))


@pytest.mark.parametrize("encoding", ["ascii", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "utf-32"])
@pytest.mark.parametrize("name", ["a.asc", "a.xyz", "a.asc.gz"])
def test_texts_are_read_in_every_encoding(folder, name, encoding):
    content = (POINTS if "xyz" in name else GRID).encode(encoding)
    if name.endswith(".gz"):
        with gzip.open(name, "wb") as file:
            file.write(content)
    else:
        (folder / name).write_bytes(content)
    np.testing.assert_allclose(Heightmap.open(name).heights, HEIGHTS)
    assert Heightmap.open(name).spacing_m == (10, 10)
    np.testing.assert_allclose(open_windows([name]).read(slice(1, 4), slice(2, 6)), HEIGHTS[1:4, 2:6])


def test_a_text_may_begin_with_an_empty_line(folder):
    (folder / "a.asc").write_bytes(("\r\n" + GRID).encode("utf-8-sig"))
    np.testing.assert_allclose(Heightmap.open("a.asc").heights, HEIGHTS)
    (folder / "a.asc").write_bytes("no grid\n".encode("utf-16"))
    with pytest.raises(TerrainError, match=r"^a\.asc: is not"):
        Heightmap.open("a.asc")


def test_a_projection_beside_a_text_counts(folder):
    (folder / "a.asc").write_bytes(GRID.encode("utf-8-sig"))
    (folder / "a.prj").write_text(rasterio.crs.CRS.from_epsg(32633).to_wkt())
    assert Heightmap.open("a.asc").place.name == "EPSG:32633"


@pytest.mark.parametrize("name", ["N00E000.hgt", "a.raw"])
def test_binary_files_are_no_texts(folder, name):
    """Low heights as big-endian numbers look like UTF-16."""
    np.full((32, 32), 0x31, ">u2").tofile(name)
    assert (Heightmap.open(name).heights == 0x31).any() or name == "a.raw"


# --- Overlays and arrays ----------------------------------------------------------------------------------------------


def placed():
    heightmap = Heightmap(np.zeros((50, 60)), 10.0)
    heightmap.georeference = Georeference(Grid(10.0, 0.0, 500000.0, 0.0, -10.0, 5000000.0), "EPSG:32633", (60, 50))
    return heightmap


def test_overlays_in_the_maps_own_system_ask_for_crs_null(folder):
    line = {"type": "LineString", "coordinates": [[500100, 4999900], [500200, 4999800]]}
    (folder / "a.geojson").write_text(json.dumps(line))
    with pytest.raises(TerrainError, match='no degrees: .*"crs": null'):
        read_overlay("a.geojson", placed())
    (folder / "b.geojson").write_bytes(json.dumps(line | {"crs": None}).encode("utf-8-sig"))
    assert len(read_overlay("b.geojson", placed()).lines) == 1


def test_overlays_that_are_no_text_have_a_next_step(folder):
    (folder / "a.shp").write_bytes(SHAPE)
    with pytest.raises(TerrainError, match=r"ogr2ogr -f GeoJSON a\.geojson a\.shp"):
        read_overlay("a.shp", placed())
    with zipfile.ZipFile("b.zip", "w") as archive:
        archive.writestr("b.shp", SHAPE)
    with pytest.raises(TerrainError, match=r"ogr2ogr -f GeoJSON b\.geojson /vsizip/b\.zip"):
        read_overlay("b.zip", placed())


def test_curvilinear_arrays_get_a_line():
    y, x = np.mgrid[0:8, 0:9]
    where = {"lat": (("y", "x"), 45 + 0.01 * y + 0.001 * x), "lon": (("y", "x"), 7 + 0.01 * x)}
    array = xarray.DataArray(np.zeros((8, 9)), dims=("y", "x"), coords=where)
    (note,) = Heightmap.of(array).notes
    assert "curvilinear" in note and "gdalwarp -geoloc" in note
    assert Heightmap.of(array.drop_vars(["lat", "lon"])).notes == ()
