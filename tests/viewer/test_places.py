"""Places that the user types."""

import numpy as np
import pytest
from viewers import settle

from terrain_gl.readers.georeference import DEGREES, Georeference, Grid
from terrain_gl.renderer.overlay import read_overlay
from terrain_gl.viewer.controller import FROM_ABOVE_DEG
from terrain_gl.viewer.orientation import place_lines


def middle(viewer):
    """The place in the middle of the picture, after the travel."""
    settle(viewer)
    return viewer.pointer.place_under(0.5 * viewer.window.size[0], 0.5 * viewer.window.size[1])


def test_the_camera_travels_to_the_highest_point(viewer):
    settle(viewer)
    viewer.go_to("Highest")
    heightmap = viewer.scene.heightmap
    row, col = np.unravel_index(np.argmax(heightmap.heights), heightmap.heights.shape)
    x, y, z = middle(viewer)
    assert abs(z - heightmap.heights.max()) < 2 and np.hypot(x - 10 * col, y - 10 * (heightmap.rows - 1 - row)) < 40
    assert viewer.scene.controller.elevation_deg <= FROM_ABOVE_DEG + 1


@pytest.mark.parametrize("typed", ["400, 700", "400 700", " 400; 700 "])
def test_metres_from_the_corner_of_a_map_without_a_place(viewer, typed):
    settle(viewer)
    viewer.exaggerate(2.0)
    viewer.go_to(typed)
    assert np.allclose(middle(viewer)[:2], (400, 700), atol=2)


@pytest.mark.slow
@pytest.mark.parametrize(
    "georeference",
    [
        Georeference(Grid(0.001, 0, -7.0, 0, -0.001, -46.0), DEGREES, (129, 129)),
        Georeference(Grid(10.0, 0, 500_000.0, 0, -10.0, 5_001_290.0), "EPSG:32632", (129, 129)),
    ],
)
def test_coordinates_as_the_window_shows_them(viewer, georeference):
    settle(viewer)
    heightmap = viewer.scene.heightmap
    heightmap.georeference = georeference
    place = np.array([400.0, 700.0, 100.0])
    _, *shown = place_lines(heightmap, place)
    lon, lat = heightmap.place.to_lonlat(400.0, 700.0)
    for typed in (*shown, f"{lat:.6f}, {lon:.6f}" if len(shown) > 1 else f"{lon:.6f}, {lat:.6f}"):
        viewer.scene.controller.home()
        viewer.go_to(typed)
        assert np.allclose(middle(viewer)[:2], (400, 700), atol=2), typed


def test_a_point_of_an_overlay_by_its_name_or_the_start_of_it(viewer):
    settle(viewer)
    heightmap = viewer.scene.heightmap
    features = [
        {"type": "Feature", "properties": {"name": name}, "geometry": {"type": "Point", "coordinates": [x, y]}}
        for name, x, y in (("Old mill", 300, 300), ("Mill", 900, 500))
    ]
    overlay = read_overlay({"type": "FeatureCollection", "crs": None, "features": features}, heightmap)
    viewer.scene.renderer.overlays = (overlay,)
    for typed in ("mill", "Old m"):
        viewer.go_to(typed)
        x, y = {"mill": (900, 500), "Old m": (300, 300)}[typed]
        assert np.allclose(middle(viewer)[:2], (x, y), atol=2)


@pytest.mark.parametrize(
    ("typed", "words"), [("nowhere", "no point of an overlay"), ("1e4, 5", "no point"), ("-5, 5", "not on")]
)
def test_what_is_no_place_is_told(viewer, typed, words):
    settle(viewer)
    before = viewer.scene.controller.pose
    viewer.go_to(typed)
    assert words in viewer.window.message and typed in viewer.window.message
    assert viewer.scene.controller.pose == before
