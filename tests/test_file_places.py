"""Where maps lie and how far their posts are apart: every projection, unit and body, and every way to say it."""

import math

import numpy as np
import pytest
from test_kinds import COLS, METRES, ROWS, raster

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.heightmap import Heightmap
from terrain_gl.readers.windows import open_windows
from terrain_gl.renderer.overlay import read_overlay

rasterio = pytest.importorskip("rasterio", reason="the [geo] extra is not installed")
pyproj = pytest.importorskip("pyproj", reason="the [geo] extra is not installed")

SPHERES = {"moon": 1737400.0, "mars": 3396190.0}


def at(crs, lon, lat, step=50.0):
    """A grid of `step` units whose middle is at a longitude and a latitude of the CRS's own datum."""
    crs = pyproj.CRS(crs)
    x, y = pyproj.Transformer.from_crs(crs.geodetic_crs, crs, always_xy=True).transform(lon, lat)
    return (step, 0, x - step * COLS / 2, 0, -step, y + step * ROWS / 2)


def spacing(path, crs, lon, lat, step=50.0):
    raster(path, grid=at(crs, lon, lat, step), crs=crs)
    return Heightmap.open(path)


def cos(lat):
    return math.cos(math.radians(lat))


FOOT = 1200 / 3937
# a map's CRS and middle; then how many metres on the ground 50 of its units are there, east and north (on a sphere)
PROJECTIONS = {
    "world mercator": ("EPSG:3395", 20, 50, 50 * cos(50), 50 * cos(50), 4e-3),
    "web mercator": ("EPSG:3857", 20, -65, 50 * cos(65), 50 * cos(65), 6e-3),
    "plate carree": ("EPSG:32662", 20, 70, 50 * cos(70), 50, 4e-3),
    "equal-area cylinder": ("EPSG:6933", 20, 60, 50 * cos(60) / cos(30), 50 * cos(30) / cos(60), 1e-2),
    "polar, far from its circle": ("EPSG:3031", 40, -45, 0, 0, 0),
    "moon, cylindrical": (f"+proj=eqc +R={SPHERES['moon']} +units=m", 20, 60, 25, 50, 1e-9),
    "mars, mercator": (f"+proj=merc +R={SPHERES['mars']} +units=m", -30, 60, 25, 25, 1e-9),
    "moon, in kilometres": (f"+proj=eqc +R={SPHERES['moon']} +units=km", 20, 60, 25_000, 50_000, 2e-3),
    "mercator in feet": ("+proj=merc +datum=WGS84 +units=us-ft", 5, 60, 25 * FOOT, 25 * FOOT, 4e-3),
}


@pytest.mark.parametrize("name", PROJECTIONS)
def test_spacing_is_measured_on_the_ground(tmp_path, name):
    crs, lon, lat, east_m, north_m, tolerance = PROJECTIONS[name]
    terrain = spacing(tmp_path / "a.tif", crs, lon, lat)
    flat = pyproj.CRS(crs)
    to_degrees = pyproj.Transformer.from_crs(flat, flat.geodetic_crs, always_xy=True)
    georeference = terrain.georeference
    x, y = georeference.middle
    ends = ((x - 25, y), (x + 25, y)), ((x, y - 25), (x, y + 25))
    geodesics = [flat.get_geod().inv(*to_degrees.transform(*a), *to_degrees.transform(*b))[2] for a, b in ends]
    assert terrain.spacing_m == pytest.approx(geodesics, rel=1e-6)
    assert len(terrain.notes) == ("feet" in name)  # the file does not say whether heights are in feet, too
    if tolerance:
        assert terrain.spacing_m == pytest.approx((east_m, north_m), rel=tolerance)
    else:
        assert min(terrain.spacing_m) < 0.95 * 50


@pytest.mark.parametrize("crs", ["EPSG:32632", "EPSG:27700", "EPSG:2154", "EPSG:2056", "EPSG:3413"])
def test_maps_true_to_scale_keep_their_round_numbers(tmp_path, crs):
    lon, lat = {"EPSG:32632": (11, 46), "EPSG:27700": (-3, 57), "EPSG:2154": (2, 46.5), "EPSG:2056": (8, 46.5)}.get(
        crs, (-45, 70)
    )
    assert spacing(tmp_path / "a.tif", crs, lon, lat).spacing_m == (50, 50)


def test_degrees_may_be_grads(tmp_path):
    raster(tmp_path / "a.tif", grid=(0.001, 0, 5, 0, -0.001, 50 + 0.001 * ROWS / 2), crs="EPSG:4807")  # 50 grads: 45°
    east, north = Heightmap.open(tmp_path / "a.tif").spacing_m
    assert (east, north) == pytest.approx((0.0009 * 111320 * cos(45), 0.0009 * 111132), rel=3e-3)


def test_without_pyproj_a_note_says_that_units_count_as_metres(tmp_path, monkeypatch):
    raster(tmp_path / "a.tif", grid=at("EPSG:3395", 20, 60), crs="EPSG:3395")
    raster(tmp_path / "b.tif", grid=at("EPSG:32632", 9, 60), crs="EPSG:32632")
    monkeypatch.setitem(__import__("sys").modules, "pyproj", None)
    terrain = Heightmap.open(tmp_path / "a.tif")
    assert terrain.spacing_m == (50, 50) and "pyproj" in terrain.notes[0] and "--spacing" in terrain.notes[0]
    assert Heightmap.open(tmp_path / "b.tif").notes == ()


# --- Ground control points and turns ----------------------------------------------------------------------------------


def with_points(path, places, crs="EPSG:32633"):
    """A map whose place is told by points alone: column, row, x, y."""
    points = [rasterio.control.GroundControlPoint(row, col, x, y) for col, row, x, y in places]
    profile = {"width": COLS, "height": ROWS, "count": 1, "dtype": "float32", "driver": "GTiff"}
    with rasterio.open(path, "w", gcps=points, crs=crs, **profile) as file:
        file.write(METRES, 1)


def on_grid(col, row):
    return col, row, 4e5 + 20 * col, 5e6 - 25 * row


CORNERS = [on_grid(0, 0), on_grid(COLS, 0), on_grid(0, ROWS), on_grid(COLS, ROWS), on_grid(17, 5)]


def test_control_points_on_a_grid_are_its_place(tmp_path):
    with_points(tmp_path / "a.tif", CORNERS)
    terrain = Heightmap.open(tmp_path / "a.tif")
    assert terrain.spacing_m == pytest.approx((20, 25)) and terrain.place.name == "EPSG:32633"
    assert terrain.place.to_map(0, 0) == pytest.approx((4e5 + 10, 5e6 - 25 * ROWS + 12.5))
    np.testing.assert_array_equal(terrain.heights, METRES)
    with rasterio.open(tmp_path / "a.tif") as data:
        assert Heightmap.of(data).spacing_m == pytest.approx((20, 25))


def test_control_points_from_the_south_turn_the_map(tmp_path):
    with_points(tmp_path / "a.tif", [(col, ROWS - row, x, y) for col, row, x, y in CORNERS])
    np.testing.assert_array_equal(Heightmap.open(tmp_path / "a.tif").heights, METRES[::-1])
    windows = open_windows([tmp_path / "a.tif"])
    np.testing.assert_array_equal(windows.read(slice(0, 4), slice(0, 9)), METRES[::-1][:4, :9])


@pytest.mark.parametrize("count", [2, 5])
def test_control_points_off_a_grid_ask_for_gdalwarp(tmp_path, count):
    bent = [(col, row, x + 3 * (col == 17), y) for col, row, x, y in CORNERS][:count]
    with_points(tmp_path / "a.tif", bent)
    with pytest.raises(TerrainError, match=rf"{count} ground control points.*gdalwarp"):
        Heightmap.open(tmp_path / "a.tif")


@pytest.mark.parametrize("turn", [1e-15, 1e-9, 2e-5])
def test_a_turn_by_rounding_errors_is_none(tmp_path, turn):
    """Over the whole map, the turn moves posts by less than a thousandth of their distance."""
    raster(tmp_path / "a.tif", grid=(30, 30 * turn, 5e5, -30 * turn, -30, 5.1e6))
    terrain = Heightmap.open(tmp_path / "a.tif")
    grid = terrain.georeference.grid
    assert terrain.spacing_m == (30, 30) and (grid.b, grid.d) == (0, 0)


@pytest.mark.parametrize("turn", [1e-4, 0.3])
def test_a_turn_that_moves_posts_is_refused(tmp_path, turn):
    raster(tmp_path / "a.tif", grid=(30, 30 * turn, 5e5, -30 * turn, -30, 5.1e6))
    with pytest.raises(TerrainError, match="not stored north up.*gdalwarp"):
        Heightmap.open(tmp_path / "a.tif")


# --- xarray -----------------------------------------------------------------------------------------------------------


@pytest.fixture
def dataset():
    xarray = pytest.importorskip("xarray", reason="xarray is not installed")
    lat, lon = 46 - 0.01 * np.arange(ROWS), 7 + 0.01 * np.arange(COLS)
    crs = xarray.DataArray(0, attrs={"crs_wkt": pyproj.CRS("EPSG:4258").to_wkt()})
    bounds = (("lat", "side"), np.zeros((ROWS, 2)))
    height = (("time", "lat", "lon"), METRES[None], {"grid_mapping": "crs"})
    return xarray.Dataset({"z": height, "lat_bounds": bounds, "crs": crs}, {"lat": lat, "lon": lon})


def test_the_only_variable_of_a_dataset_is_the_map(dataset):
    terrain = Heightmap.of(dataset)
    np.testing.assert_array_equal(terrain.heights, METRES)
    assert terrain.place.name == "EPSG:4258"
    assert terrain.spacing_m == pytest.approx(Heightmap.of(dataset["z"]).spacing_m)


def test_several_variables_of_a_dataset_are_listed(dataset):
    dataset["age"] = dataset["z"] * 2
    with pytest.raises(TerrainError, match=r"variables z, age: give the one with heights, as dataset\['z'\]"):
        Heightmap.of(dataset)
    with pytest.raises(TerrainError, match="with the variables crs"):
        Heightmap.of(dataset[["crs"]])


def test_coordinates_may_be_rounded_to_float32(dataset):
    """Steps of an arc second at 100 degrees east are off by a fortieth in float32."""
    few = dataset.assign_coords(lon=(100 + np.arange(COLS) / 3600).astype("f4"))
    assert Heightmap.of(few).cols == COLS
    bent = few["lon"].values.copy()
    bent[20:] += 1 / 3600
    with pytest.raises(TerrainError, match="not evenly spaced along lon"):
        Heightmap.of(few.assign_coords(lon=bent))


# --- Longitudes are the same modulo 360 degrees -----------------------------------------------------------------------

# a map's CRS, middle in its units, and step; its middle is at 75° west, and 60° north or 0
TURNS = {
    "degrees to the east": ("EPSG:4326", 285.0, 60.0, 1e-3),
    "degrees to the west": ("EPSG:4326", -435.0, 60.0, 1e-3),
    "other degrees": ("EPSG:4269", 285.0, 60.0, 1e-3),
    "web mercator": ("EPSG:3857", 285 * 111319.4907932736, 8399737.89, 60),
    "moon": (f"+proj=eqc +R={SPHERES['moon']} +units=m", math.radians(285) * 1737400, math.radians(60) * 1737400, 60),
}


@pytest.mark.parametrize("name", TURNS)
@pytest.mark.parametrize("lon", [-75.0, 285.0])
def test_a_place_is_found_by_any_of_its_longitudes(tmp_path, name, lon):
    crs, x, y, step = TURNS[name]
    raster(tmp_path / "a.tif", grid=(step, 0, x - step * COLS / 2, 0, -step, y + step * ROWS / 2), crs=crs)
    terrain = Heightmap.open(tmp_path / "a.tif")
    middle = np.array(terrain.extent_m) / 2
    assert terrain.place.from_lonlat(lon, 60.0) == pytest.approx(middle, abs=0.02 * middle.max())
    feature = {"type": "LineString", "coordinates": [[lon, 60.0], [lon + 0.001, 60.001]]}
    points = {"type": "MultiPoint", "coordinates": [[lon - 360, 60.0], [lon, 60.0], [lon + 150, 0.0]]}
    laid = read_overlay({"type": "GeometryCollection", "geometries": [feature, points]}, terrain)
    for post in (laid.lines[0][0], laid.points[0], laid.points[1]):
        assert post == pytest.approx((COLS / 2 - 0.5, ROWS / 2 - 0.5), abs=0.5)


def test_a_line_over_the_seam_stays_in_one_piece(tmp_path):
    """From 179 to -179 is two degrees, and no line around the Earth."""
    raster(tmp_path / "a.tif", grid=(0.1, 0, 178, 0, -0.1, 1.5), crs="EPSG:4326")
    terrain = Heightmap.open(tmp_path / "a.tif")
    over = {"type": "LineString", "coordinates": [[179, 0], [-179, 0]]}
    far = {"type": "LineString", "coordinates": [[-0.5, 0], [0.5, 0]]}  # opposite the map, where its 360 degrees begin
    laid = read_overlay({"type": "GeometryCollection", "geometries": [over, far]}, terrain)
    for line, length in zip(laid.lines, (20, 10), strict=True):
        assert abs(line[1, 0] - line[0, 0]) == pytest.approx(length)
    assert laid.lines[0][0, 0] == pytest.approx(9.5)


def test_projections_that_are_no_cylinder_have_no_turn(tmp_path):
    raster(tmp_path / "a.tif")
    place = Heightmap.open(tmp_path / "a.tif").place
    far = np.array([5e5, 4e7])
    np.testing.assert_array_equal(place.nearest_turn(far), far)


def test_a_picture_of_the_ground_is_found_by_any_of_its_longitudes(tmp_path):
    from terrain_gl.light.laid import read_ground

    grid = (0.001, 0, 285, 0, -0.001, 46)
    raster(tmp_path / "a.tif", grid=grid, crs="EPSG:4326")
    terrain = Heightmap.open(tmp_path / "a.tif")
    colours = np.full((3, ROWS, COLS), 200, "u1")
    for west in (285, -75):
        raster(tmp_path / "p.tif", colours, grid=(0.001, 0, west, 0, -0.001, 46), crs="EPSG:4326")
        albedo = read_ground(str(tmp_path / "p.tif"), terrain.georeference)
        assert (albedo[..., 3] == 1).all()


@pytest.mark.parametrize(
    ("unit", "metres"),
    [
        *((word, 1.0) for word in ("m", "Metres", "meter above sea level", "m a.s.l.")),
        *((word, 0.3048) for word in ("ft", "Feet", "foot", "international_foot")),
        *((word, 1200 / 3937) for word in ("US survey feet", "us-ft", "US_survey_foot", "ftUS", "foot_us", "sft")),
        *(
            ("kilometre", 1000.0),
            ("Decimeters", 0.1),
            ("cm", 0.01),
            ("mm", 0.001),
            ("yards", 0.9144),
            ("inches", 0.0254),
        ),
    ],
)
def test_units_of_heights_by_any_of_their_names(tmp_path, unit, metres):
    raster(tmp_path / "a.tif", METRES / np.float32(metres), unit=unit)
    terrain = Heightmap.open(tmp_path / "a.tif")
    np.testing.assert_allclose(terrain.heights, METRES, rtol=1e-6)
    assert terrain.notes == ()


@pytest.mark.parametrize("unit", ["m/s", "m s-1", "hPa", "0.1 m"])
def test_other_units_get_a_line(tmp_path, unit):
    raster(tmp_path / "a.tif", unit=unit)
    terrain = Heightmap.open(tmp_path / "a.tif")
    assert terrain.range_m == (100, 820) and "values count as metres" in terrain.notes[0]


# --- Mosaics ----------------------------------------------------------------------------------------------------------


def tiles(folder, systems):
    for i, crs in enumerate(systems):
        raster(folder / f"{i}.tif", grid=(60, 0, 1e6 + 60 * COLS * i, 0, -60, 8.4e6), crs=crs)
    return [folder / f"{i}.tif" for i in range(len(systems))]


@pytest.mark.parametrize("systems", [(None, "EPSG:3395"), ("EPSG:3395", None), (None, "EPSG:3395", None)])
def test_one_file_names_the_coordinate_system_of_a_mosaic(tmp_path, systems):
    windows = open_windows(tiles(tmp_path, systems))
    alone = Heightmap.open(tmp_path / f"{systems.index('EPSG:3395')}.tif")
    assert windows.georeference.crs == alone.georeference.crs
    assert windows.spacing_m == pytest.approx(alone.spacing_m, rel=1e-6) and windows.spacing_m < (40, 40)
    assert windows.georeference.grid.c == 1e6 and windows.shape == (ROWS, COLS * len(systems))
    silent, teller = systems.index(None), systems.index("EPSG:3395")
    assert f"{silent}.tif names no coordinate system: that of " in windows.notes[0]
    assert f"{teller}.tif counts for all files" in windows.notes[0] and len(windows.notes) == 1


@pytest.mark.parametrize(
    ("degrees", "wests", "order"),
    [(1.025, (179, -179.975, 177.975), (2, 0, 1)), (82, (0, -82, 82, -164), (3, 1, 0, 2))],
)
def test_tiles_on_both_sides_of_the_antimeridian_are_neighbours(tmp_path, degrees, wests, order):
    """Tiles of a degree over the antimeridian; and tiles nearly all around the Earth, which need no turn."""
    for i, west in enumerate(wests):
        grid = (degrees / COLS, 0, west, 0, -degrees / COLS, 10)
        raster(tmp_path / f"{i}.tif", METRES + 1000 * i, grid=grid, crs="EPSG:4326")
    windows = open_windows([tmp_path / f"{i}.tif" for i in range(len(wests))])
    together = np.hstack([METRES + 1000 * i for i in order])
    assert windows.shape == together.shape
    np.testing.assert_array_equal(windows.read(slice(0, ROWS), slice(0, windows.shape[1])), together)


@pytest.mark.parametrize("systems", [("EPSG:3395", "EPSG:32632"), (None, "EPSG:3395", "EPSG:3857")])
def test_several_coordinate_systems_are_refused_by_two_names(tmp_path, systems):
    other = len(systems) - 1
    with pytest.raises(TerrainError, match=rf"{other}\.tif: has another coordinate system than .*{other - 1}\.tif"):
        open_windows(tiles(tmp_path, systems))
