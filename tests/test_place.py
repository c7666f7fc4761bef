"""The place of a map on the Earth: it is read, never lost, and reported in degrees and in metres."""

import json
import sys
from datetime import datetime

import numpy as np
import pytest
from commands import parse

import terrain_gl as tg
from terrain_gl.basics.exceptions import TerrainError, UsageError
from terrain_gl.cli.scene import open_scene
from terrain_gl.files.writers import write_heightmap
from terrain_gl.light.sun import sun_position
from terrain_gl.viewer.loading import preview, scaled

rasterio = pytest.importorskip("rasterio", reason="the [geo] extra is not installed")
warp = pytest.importorskip("rasterio.warp", reason="the [geo] extra is not installed")
pyproj = pytest.importorskip("pyproj", reason="the [geo] extra is not installed")

SIZE = ("--size", "64x48")
UTM, MERCATOR = "EPSG:32632", "EPSG:3857"
COLS, ROWS = 41, 31


def hill():
    y, x = np.mgrid[0:ROWS, 0:COLS]
    return (1000 + 90 * np.exp(-((x - 25) ** 2 + (y - 10) ** 2) / 40)).astype("f4")  # top at column 25, row 10


def geotiff(path, crs=UTM, first=(500_000.0, 5_150_000.0), step=30.0, heights=None, south_up=False):
    """Write a GeoTIFF; `first` is the corner of its first, north-western post's cell."""
    heights = hill() if heights is None else heights
    x, y = first
    transform = rasterio.Affine(step, 0, x, 0, -step, y)
    if south_up:
        heights, transform = heights[::-1], rasterio.Affine(step, 0, x, 0, step, y - len(heights) * step)
    profile = {"driver": "GTiff", "width": heights.shape[1], "height": len(heights), "count": 1, "dtype": "float32"}
    with rasterio.open(path, "w", crs=crs, transform=transform, **profile) as out:
        out.write(heights, 1)
    return path


CASES = {
    "projected": {},
    "south up": {"south_up": True},
    "feet and metres": {"crs": "EPSG:2263", "first": (980_000.0, 200_000.0), "step": 100.0},
    "degrees": {"crs": "EPSG:4326", "first": (7.5, 46.5), "step": 0.001},
    "web mercator": {"crs": MERCATOR, "first": (850_000.0, 5_800_000.0)},
    "compound": {"crs": "EPSG:25832+7837"},
}


@pytest.mark.parametrize("case", CASES)
def test_posts_have_the_coordinates_that_gdal_gives_them(folder, case):
    heightmap = tg.Heightmap.open(geotiff("a.tif", **CASES[case]))
    east, north = heightmap.spacing_m
    with rasterio.open("a.tif") as data:
        for row, col in ((0, 0), (0, COLS - 1), (ROWS - 1, 0), (10, 25)):
            there = data.xy(ROWS - 1 - row if data.transform.e > 0 else row, col)
            world = col * east, (ROWS - 1 - row) * north
            assert heightmap.place.to_map(*world) == pytest.approx(there, rel=1e-12)
            lon, lat = warp.transform(data.crs, "EPSG:4326", *([v] for v in there))[:2]
            assert heightmap.place.to_lonlat(*world) == pytest.approx((lon[0], lat[0]), abs=2e-6)
            assert heightmap.place.from_lonlat(lon[0], lat[0]) == pytest.approx(world, abs=0.3)
            assert heightmap.place.from_map(*there) == pytest.approx(world, abs=1e-6)


def test_an_hgt_tile_lies_where_its_name_says(folder):
    np.zeros((11, 11), ">i2").tofile("S03W061.hgt")
    place = tg.Heightmap.open("S03W061.hgt").place
    assert place.to_lonlat(0, 0) == pytest.approx((-61, -3)) and place.middle == pytest.approx((-60.5, -2.5))


def test_a_map_without_a_place_has_none(folder):
    np.save("a.npy", hill())
    assert tg.Heightmap.open("a.npy").place is None and tg.Heightmap(hill()).place is None


def test_another_planet_has_degrees_of_its_own(folder):
    moon = "+proj=eqc +lon_0=0 +R=1737400 +units=m"
    place = tg.Heightmap.open(geotiff("a.tif", crs=moon, first=(0.0, 303_233.6), step=1000.0)).place
    assert place.to_lonlat(*place.from_map(0.0, 303_233.6)) == pytest.approx((0, 10), abs=1e-4)


def test_a_place_outlives_copies_edits_previews_and_exaggeration(folder):
    heightmap = tg.Heightmap.open(geotiff("a.tif"))
    kept = heightmap.place
    heightmap.write(3, 3, np.ones((2, 2)))
    twice = scaled(heightmap, 2.0)
    assert heightmap.place == heightmap.copy().place == twice.place == kept
    large = tg.Heightmap.open(geotiff("b.tif", heights=np.zeros((900, 1000), "f4")))
    few = preview(large)
    for corner in ((0.0, 0.0), large.extent_m):
        assert few.place.to_map(*corner) == pytest.approx(large.place.to_map(*corner), abs=1e-6)


# --- Files ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("case", CASES)
def test_a_saved_tiff_lies_where_the_map_lies(folder, case):
    heightmap = tg.Heightmap.open(geotiff("a.tif", **CASES[case]))
    heightmap.write(5, 5, [[np.nan, 3.5]])
    write_heightmap("b.tif", heightmap)
    again = tg.Heightmap.open("b.tif")
    np.testing.assert_array_equal(again.heights, heightmap.heights)
    assert again.spacing_m == pytest.approx(heightmap.spacing_m, rel=1e-9)
    with rasterio.open("a.tif") as before, rasterio.open("b.tif") as after:
        assert sorted(after.bounds) == pytest.approx(sorted(before.bounds)) and after.transform.e < 0
        flat = pyproj.CRS.from_user_input(before.crs.to_wkt())
        flat = flat.sub_crs_list[0] if flat.is_compound else flat
        assert pyproj.CRS.from_user_input(after.crs.to_wkt()).equals(flat, ignore_axis_order=True)
        assert np.isnan(after.nodata)


def test_a_tiff_that_cannot_be_written_is_one_line(folder, monkeypatch):
    heightmap = tg.Heightmap.open(geotiff("a.tif"))

    def full(*_args, **_options):
        raise rasterio.errors.RasterioIOError("No space left on device")

    monkeypatch.setattr("rasterio.io.DatasetWriter.write", full)
    with pytest.raises(TerrainError, match=r"b\.tif: cannot write: No space"):
        write_heightmap("b.tif", heightmap)
    assert not (folder / "b.tif").exists()


# --- The command line -------------------------------------------------------------------------------------------------


def test_info_tells_where_a_map_lies(folder, run):
    geotiff("a.tif")
    told = json.loads(run("info", "a.tif", "--json", "-")[1])["map"]
    assert told["crs"] == UTM and told["transform"] == [500_000, 30, 0, 5_150_000, 0, -30]
    assert told["middle_lonlat"] == pytest.approx([9.008, 46.5], abs=0.01)
    assert "9.00" in (out := run("info", "a.tif")[1]) and "° N" in out and UTM in out
    np.save("a.npy", hill())
    assert json.loads(run("info", "a.npy", "--json", "-")[1])["map"]["crs"] is None


def camera(*words):
    return open_scene(parse("measure", *words)).camera


def lonlat(col, row):
    place = tg.Heightmap.open("a.tif").place
    lon, lat = place.to_lonlat(30.0 * col, 30.0 * (ROWS - 1 - row))
    return f"{lon:.12f},{lat:.12f}"


def test_eye_and_target_in_degrees(folder):
    geotiff("a.tif")
    top = camera("a.tif", "--at", lonlat(25, 10)).target
    assert top == pytest.approx((750, 600, 1090), abs=0.01)
    assert camera("a.tif", "--at", lonlat(25, 10) + ",50").target[2] == pytest.approx(1140, abs=0.01)
    seen = camera("a.tif", "--at", lonlat(25, 10), "--from", lonlat(5, 25) + ",100")
    assert seen.eye == pytest.approx((150, 150, 1100), abs=0.1) and seen.target == pytest.approx(top)
    assert camera("a.tif", "--at", lonlat(25, 10), "--eye", "1,2,3000").eye == (1, 2, 3000)


@pytest.mark.parametrize("post", [(25, 10), (0, 0), (40, 30)])
def test_a_place_alone_is_seen_from_near_by(folder, post):
    geotiff("a.tif")
    near, first = camera("a.tif", "--at", lonlat(*post)), camera("a.tif")
    away = np.subtract(near.eye, near.target)
    assert np.linalg.norm(away[:2]) <= 0.3 * 40 * 30 < np.linalg.norm(np.subtract(first.eye, first.target))
    assert near.eye[2] > hill().max() - 90 + 2 * 30 - 1


@pytest.mark.parametrize(
    ("words", "status", "text"),
    [
        (("a.tif", "--at", "0,0"), 2, "lies off the map"),
        (("a.npy", "--at", "9,46"), 2, "its place on the Earth is not known"),
        (("a.tif", "--at", "9,95"), 2, "expected degrees"),
        (("a.tif", "--at", "9,46", "--target", "1,2,3"), 2, "not allowed with"),
        (("a.npy", "--time", "2026-06-21T12:00"), 2, "--latitude"),
        (("a.tif", "--latitude", "12"), 2, "--time"),
    ],
)
def test_places_that_cannot_be_meant(folder, run, words, status, text):
    geotiff("a.tif")
    np.save("a.npy", hill())
    code, out, err = run("measure", *words, *SIZE)
    assert (code, out, err.count("\n")) == (status, "", 1) and text in err


def test_the_sun_of_a_time_stands_over_the_map(folder):
    geotiff("a.tif")
    lon, lat = tg.Heightmap.open("a.tif").place.middle
    for time in ("2026-06-21T15:30", "2026-06-21T15:30+02:00"):
        scene = open_scene(parse("measure", "a.tif", "--time", time))
        assert scene.frame.sun == pytest.approx(sun_position(datetime.fromisoformat(time), lat, lon))
    given = open_scene(parse("measure", "a.tif", "--time", "2026-06-21T15:30", "--latitude", "-30"))
    assert given.frame.sun == pytest.approx(sun_position(datetime(2026, 6, 21, 15, 30), -30.0))


def test_without_a_coordinate_system_there_are_no_degrees(folder):
    geotiff("a.tif", crs=None)
    place = tg.Heightmap.open("a.tif").place
    assert place.to_map(0, 0) == (500_015, 5_150_000 - 30 * ROWS + 15)
    with pytest.raises(UsageError, match="no coordinate system"):
        place.to_lonlat(0, 0)


def test_without_pyproj_a_line_says_what_to_install(folder, monkeypatch):
    heightmap = tg.Heightmap.open(geotiff("a.tif", "EPSG:32750"))  # no other test asks for its degrees
    monkeypatch.setitem(sys.modules, "pyproj", None)
    with pytest.raises(TerrainError, match="coordinate systems need pyproj"):
        heightmap.place.to_lonlat(0.0, 0.0)
