"""North, the scale, and the place under the cursor; a click's popup begins with plain words."""

import math

import numpy as np
import pytest
from viewers import hills, later, settle, texts

from terrain_gl.camera import Camera
from terrain_gl.heightmap import Heightmap
from terrain_gl.readers.georeference import DEGREES, Georeference, Grid
from terrain_gl.viewer.controller import Controller
from terrain_gl.viewer.orientation import arrow, place_lines, scale_bar
from terrain_gl.viewer.pose import Pose


@pytest.mark.parametrize(("height", "fov"), [(300.0, 40.0), (1234.0, 60.0), (7.0, 20.0)])
def test_the_scale_bar_is_a_round_length_as_long_as_the_picture_shows_it(height, fov):
    """Straight down on level land: so many metres are as many pixels as the camera makes of them."""
    level = Heightmap(np.zeros((65, 65)), 20.0)
    camera = Camera((640.0, 640.0, height), (640.0, 640.0, 0.0), fov)
    length_m, px = scale_bar(Controller(level, camera), (800, 500), 120.0)
    assert px == pytest.approx(length_m * 250 / (math.tan(math.radians(fov / 2)) * height), rel=1e-3)
    assert 40 < px <= 120 and f"{length_m:e}"[0] in "125"


def test_the_sky_has_no_scale():
    sky = Camera((640.0, 640.0, 300.0), (640.0, 700.0, 900.0))
    assert scale_bar(Controller(hills(), sky), (800, 500), 120.0) is None


def test_a_place_in_words():
    heightmap = hills()
    place = np.array([100.0, 250.0, 141.6])
    assert place_lines(heightmap, place) == ["height 142 m", "100 m east, 250 m north of the corner"]
    heightmap.georeference = Georeference(Grid(0.001, 0, 7.0, 0, -0.001, 46.129), DEGREES, (129, 129))
    assert place_lines(heightmap, place)[1:] == ["46.02550° N 7.01050° E"]
    heightmap.georeference = Georeference(Grid(10.0, 0, 500_000.0, 0, -10.0, 5_001_290.0), None, (129, 129))
    assert place_lines(heightmap, place)[1:] == ["500105.0 E, 5000255.0 N"]


def test_the_window_tells_where_one_is(app):
    """With the panel; the place of the cursor while it is over the land."""
    app.mouse_move(600, 500)
    shown = texts(app)
    assert "\nN   " in shown and "height " in shown and "north of the corner" in shown
    app.viewer.exaggerate(2.0)
    settle(app)
    place = app.viewer.pointer.place_under(600, 500)
    truth = app.viewer.scene.renderer.height_at(place[0], place[1])
    assert place[2] == pytest.approx(truth, abs=0.5) and f"height {truth:.0f} m" in texts(app)
    app.mouse_move(600, 3)  # the sky
    assert "north of the corner" not in texts(app)
    app.press("i")
    assert "\nN   " not in texts(app)


@pytest.mark.parametrize("azimuth", [0.0, 30.0, 90.0, 200.0])
def test_the_arrow_points_north(azimuth):
    """Where a step to the north goes in the picture of a camera that looks down and `azimuth` degrees east of north."""
    axes = Pose((0.0, 0.0, 100.0), azimuth, -60.0, 45.0).axes
    right, up, _ = axes @ [0.0, 1.0, 0.0]
    tip, *base = arrow(azimuth)
    pointing = tip - np.mean(base, 0)
    assert np.sign(np.round(pointing, 9)).tolist() == np.sign(np.round([right, -up], 9)).tolist()
    assert pointing / np.linalg.norm(pointing) == pytest.approx(
        [math.sin(math.radians(-azimuth)), -math.cos(math.radians(azimuth))]
    )


def test_a_popup_begins_with_plain_words(app):
    settle(app)
    app.mouse_down("left", 600, 500)
    app.mouse_up("left", 600, 500)
    settle(app)
    shown = texts(app)
    assert app.viewer.explainer.explanation
    plain = shown.index("drawn at most ")
    assert "px allowed" in shown and shown.index("height ") < plain < shown.index("posts apart")


def test_the_time_of_day_is_that_of_the_map(app):
    """South of the equator the sun of midday stands in the north."""
    app.viewer.scene.heightmap.georeference = Georeference(Grid(0.001, 0, 20.0, 0, -0.001, -34.0), DEGREES, (129, 129))
    app.panels.opened |= {"Picture": True, "Detail": False, "Understand": False}
    settle(app)
    left, top, right, bottom = app.gui.widgets.places["time of day"]
    at = left + 0.4 * (right - left), (top + bottom) / 2  # about midday
    for event in (
        lambda: app.gui.move(*at),
        lambda: app.gui.button("left", True),
        lambda: app.gui.button("left", False),
    ):
        event()
        later(app, 0.1)
    azimuth, elevation = app.viewer.settings.options.sun
    assert math.cos(math.radians(azimuth)) > 0.3 and 10 < elevation < 60
