"""Lines and points over a map, by their coordinate system."""

import json

import numpy as np
import pytest

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.heightmap import Heightmap
from terrain_gl.readers.georeference import DEGREES, Georeference, Grid
from terrain_gl.renderer.overlay import read_overlay

UTM = "EPSG:32632"


def heightmap_in(crs, grid):
    heightmap = Heightmap(np.zeros((41, 61), "f4"), 30.0)
    heightmap.georeference = Georeference(grid, crs, (61, 41))
    return heightmap


@pytest.fixture
def utm():
    """Posts of 30 m; the middle of the first pixel lies at 500,000 E, 5,100,000 N."""
    return heightmap_in(UTM, Grid(30.0, 0.0, 499_985.0, 0.0, -30.0, 5_100_015.0))


class Shape:
    """An object like those of shapely and geopandas."""

    def __init__(self, geometry, crs=None):
        self.__geo_interface__, self.crs = geometry, crs


def test_degrees_come_to_the_right_post(utm, tmp_path):
    pytest.importorskip("pyproj", reason="the extra [geo] is not installed")
    lon, lat = utm.place.to_lonlat(30.0 * 20, 30.0 * (40 - 10))
    path = tmp_path / "way.geojson"
    line = {"type": "LineString", "coordinates": [[lon, lat, 812.0], [lon + 0.001, lat, 3.0]]}
    features = [{"type": "Feature", "geometry": line}, {"type": "Feature", "geometry": None}]
    features += [{"type": "Feature", "geometry": {"type": "Point", "coordinates": [lon, lat]}}]
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    overlay = read_overlay(path, utm)
    assert len(overlay.lines) == 1 and overlay.lines[0].shape == (2, 2)
    assert overlay.lines[0][0] == pytest.approx([20.0, 10.0], abs=1e-3)
    assert overlay.points == pytest.approx(np.array([[20.0, 10.0]]), abs=1e-3)


def test_an_objects_own_coordinate_system_counts(utm):
    pytest.importorskip("pyproj", reason="the extra [geo] is not installed")
    point = {"type": "Point", "coordinates": [500_300.0, 5_099_700.0]}
    expected = np.array([[10.0, 10.0]])
    assert read_overlay(Shape(point, UTM), utm).points == pytest.approx(expected)
    assert read_overlay(Shape(point), utm).points == pytest.approx(expected)  # the map's own coordinates
    named = point | {"crs": {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::32632"}}}
    assert read_overlay(named, utm).points == pytest.approx(expected)


def test_degrees_on_a_map_in_degrees_need_no_pyproj(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pyproj", None)
    heightmap = heightmap_in(DEGREES, Grid(0.001, 0.0, 7.0 - 0.0005, 0.0, -0.001, 46.0 + 0.0005))
    overlay = read_overlay({"type": "MultiPoint", "coordinates": [[7.01, 45.98], [7.0, 46.0]]}, heightmap)
    assert overlay.points == pytest.approx(np.array([[10.0, 20.0], [0.0, 0.0]]), abs=1e-6)


def test_polygons_are_rings_and_collections_are_unpacked():
    ring, hole = [[0, 0], [300, 0], [300, 300], [0, 0]], [[30, 30], [60, 30], [60, 60], [30, 30]]
    parts = [
        {"type": "Polygon", "coordinates": [ring, hole]},
        {"type": "MultiPolygon", "coordinates": [[ring], [hole]]},
    ]
    parts += [{"type": "MultiLineString", "coordinates": [[[0, 0], [30, 60]], [[1, 1], [2, 2]]]}]
    overlay = read_overlay(
        Shape({"type": "GeometryCollection", "geometries": parts}), Heightmap(np.zeros((41, 61)), 30.0)
    )
    assert len(overlay.lines) == 6 and len(overlay.points) == 0
    assert np.allclose(overlay.lines[0], [[0, 40], [10, 40], [10, 30], [0, 40]])  # metres from the south-west post


DEEP = {"type": "Point", "coordinates": [0, 0]}
for _ in range(20):
    DEEP = {"type": "GeometryCollection", "geometries": [DEEP]}


@pytest.mark.parametrize(
    "text",
    ["", "{", "[1, 2]", "3", "{}", '{"type": "Circle"}', '{"type": "LineString", "coordinates": [[1], [2]]}']
    + ['{"type": "LineString", "coordinates": [[1, 2], [3]]}', '{"type": "Point", "coordinates": ["a", "b"]}']
    + ['{"type": "Point", "coordinates": [1e999, 2]}', '{"type": "Point", "coordinates": {"x": 1}}', "\0\xff"]
    + ['{"type": "FeatureCollection", "features": [3]}', '{"type": ["Point"]}', json.dumps(DEEP)]
    + ['{"type": "Point", "coordinates": [7, 46], "crs": {"properties": {"name": "nonsense"}}}', "[" * 100_000],
)
def test_what_is_no_geojson_gives_one_line_with_the_name(utm, tmp_path, text):
    path = tmp_path / "bad.geojson"
    path.write_text(text, "latin-1")
    with pytest.raises(TerrainError, match="bad.geojson") as error:
        read_overlay(path, utm)
    assert "\n" not in str(error.value)


def test_a_file_can_have_metres_from_the_corner_of_a_map_without_a_place(tmp_path):
    path = tmp_path / "hut.geojson"
    path.write_text(json.dumps({"type": "Point", "coordinates": [300.0, 600.0], "crs": None}))
    overlay = read_overlay(path, Heightmap(np.zeros((41, 61), "f4"), 30.0))
    assert overlay.points == pytest.approx(np.array([[10.0, 20.0]]))


def test_degrees_without_a_place_are_refused(tmp_path):
    (tmp_path / "way.json").write_text('{"type": "Point", "coordinates": [7, 46]}')
    for source in (tmp_path / "way.json", tmp_path / "gone.json", 7):
        with pytest.raises(TerrainError):
            read_overlay(source, Heightmap(np.zeros((41, 61)), 30.0))
