"""The ruler: lengths, climb and profile of a line of clicks."""

import numpy as np
import pytest
from viewers import changed, later, listen, seen, settle, texts

from terrain_gl.heightmap import Heightmap
from terrain_gl.viewer.profile_plot import ticks
from terrain_gl.viewer.ruler import MOST, Ruler, profile


def ramp(slope=0.75, posts=41):
    """A map that rises to the east."""
    east = 10.0 * np.arange(posts)
    return Heightmap(np.broadcast_to(slope * east, (posts, posts)).astype("f4"), 10.0)


def test_a_ramp_up_and_down_again():
    measured = profile(ramp(), np.array([[0.0, 50.0], [400.0, 50.0], [200.0, 50.0]]))
    assert measured.length_m == pytest.approx(600.0)
    assert measured.ground_m == pytest.approx(600.0 * 1.25, rel=1e-6)  # 3, 4, 5
    assert (measured.climb_m, measured.descent_m) == pytest.approx((300.0, 150.0), rel=1e-6)
    assert np.allclose(measured.height_m, 0.75 * measured.places[:, 0], atol=1e-3)


def test_a_ridge_between_two_posts_is_not_jumped_over():
    heights = np.zeros((9, 400), "f4")
    heights[:, 200] = 30.0
    measured = profile(Heightmap(heights, 5.0), np.array([[2.0, 19.0], [1990.0, 21.0]]))
    assert measured.climb_m == pytest.approx(30.0)


def test_a_gap_without_land_is_crossed_straight():
    heights = ramp().heights.copy()
    heights[:, 15:25] = np.nan
    measured = profile(Heightmap(heights, 10.0), np.array([[0.0, 200.0], [400.0, 200.0]]))
    assert np.isnan(measured.height_m).any()
    assert measured.ground_m == pytest.approx(500.0, rel=1e-6) and measured.climb_m == pytest.approx(300.0)


def test_a_long_line_has_a_limited_number_of_places():
    corners = np.array([[0.0, 0.0], [4000.0, 4000.0]] * 30)
    assert len(profile(ramp(), corners).along_m) <= MOST + len(corners)


def test_a_line_ends_and_another_begins():
    ruler = Ruler()
    ruler.toggle()
    for corner in ((0.0, 0.0), (3.0, 0.0), (3.0, 0.0), (3.0, 4.0)):
        ruler.add(*corner)
    assert ruler.corners == [(0.0, 0.0), (3.0, 0.0), (3.0, 4.0)]
    ruler.end()
    ruler.add(1.0, 1.0)
    assert ruler.corners == [(1.0, 1.0)] and not ruler.toggle() and ruler.corners == []


@pytest.mark.parametrize(("low", "high"), [(0.0, 1.0), (812.3, 2431.0), (-3.0, -2.9), (0.0, 40000.0)])
def test_ticks_are_few_and_round(low, high):
    marks = ticks(low, high)
    assert 1 <= len(marks) <= 5 and low - 1e-6 <= marks[0] and marks[-1] <= high + 1e-6


def click(app, x, y):
    app.mouse_down("left", x, y)
    app.mouse_up("left", x, y)
    later(app, 0.1)


def test_clicks_measure_and_esc_puts_it_away(app):
    app.viewer.settings.panel = False
    settle(app)
    before = seen(app)
    app.press("shift+r")
    for at in ((500, 400), (700, 420), (600, 550), (600, 550)):
        click(app, *at)
    settle(app)
    corners = app.viewer.ruler.corners
    assert len(corners) == 3 and not app.viewer.scene.controller.moving
    assert np.allclose(corners[0], app.viewer.pointer.place_under(500, 400)[:2])
    measured = app.viewer.ruler.profile(app.viewer.scene.heightmap)
    shown = texts(app)
    assert f"{measured.length_m:,.0f} m on the map" in shown
    assert f"{measured.ground_m:,.0f} m along the ground" in shown
    assert f"{measured.climb_m:.0f} m up" in shown and "profile" in app.gui.widgets.places
    assert changed(seen(app)[:, 450:], before[:, 450:]) > 0.003  # the line on the land
    assert len({title for title, *_ in listen(app).windows}) == len(listen(app).windows)
    app.viewer.exaggerate(3.0)  # lengths and heights stay those of the land
    settle(app)
    assert f"{measured.ground_m:,.0f} m along the ground" in texts(app)
    app.viewer.exaggerate(1.0)
    settle(app)
    click(app, 650, 450)
    assert len(app.viewer.ruler.corners) == 1
    app.press("escape")
    assert not app.viewer.ruler.taken and not app.viewer.window.closing
    click(app, 650, 450)
    assert app.viewer.ruler.corners == []
