"""The tour of a window at rest, and the small map of the panel."""

import math

import numpy as np
import pytest
from viewers import changed, later, listen, seen, settle, stroke

from terrain_gl.viewer.overview import outline
from terrain_gl.viewer.tour import REST_S


@pytest.mark.parametrize("ends", ["key", "click", "wheel"])
def test_a_tour_begins_after_two_minutes_and_any_input_ends_it_where_the_user_was(app, ends):
    viewer = app.viewer
    before = viewer.scene.controller.pose
    later(app, 10 * REST_S)
    assert not viewer.tour.is_running  # not in a notebook, or in a test
    viewer.tour.after_s = REST_S
    viewer.tour.touch()
    later(app, REST_S - 1)
    assert not viewer.tour.is_running
    later(app, 2)
    assert viewer.tour.is_running and viewer.scene.controller.moving
    for _ in range(20):
        later(app, 0.2)
    now = viewer.scene.controller.pose
    assert 5 < (before.azimuth_deg - now.azimuth_deg) % 360 < 20 and now.eye != before.eye
    style = viewer.settings.options.style
    if ends == "key":
        app.key_down("tab", "tab")
    elif ends == "click":
        app.mouse_down("left", 600.0, 300.0)
        app.mouse_up("left", 600.0, 300.0)
    else:
        app.wheel(0.0, 1.0, 600.0, 300.0)
    assert not viewer.tour.is_running and viewer.settings.options.style == style
    settle(app)
    assert viewer.scene.controller.mode == "fly"
    if ends != "wheel":  # the wheel goes nearer from there
        assert viewer.scene.controller.pose == before


def test_a_lecture_and_a_brush_keep_the_tour_away(app):
    viewer = app.viewer
    viewer.tour.after_s = REST_S
    app.press("b")
    for _ in range(5):
        later(app, REST_S)
    assert not viewer.tour.is_running
    app.press("b")
    later(app, REST_S - 1)
    assert not viewer.tour.is_running  # two minutes begin anew
    for _ in range(3):
        later(app, REST_S)
    assert viewer.tour.is_running


def test_the_small_map_follows_strokes_and_their_undoing(app):
    app.resize((900, 900), 1.0)
    app.panels.opened |= dict.fromkeys(app.panels.opened, False) | {"Camera": True}

    def small_map():
        for _ in range(3):
            listen(app)
        left, top, right, bottom = (round(each) for each in app.gui.widgets.places["overview"])
        return seen(app)[top:bottom, left:right]

    before = small_map()
    app.press("b")
    settle(app)
    app.viewer.sculpting.tool.radius_m = 300.0
    stroke(app.viewer, (600, 450), (650, 450))
    assert app.viewer.sculpting.unsaved
    after = small_map()
    assert 0.01 < changed(after, before) < 0.9
    app.press("ctrl+z")
    settle(app)
    assert changed(small_map(), before) < 0.01


def test_the_small_map_has_the_outline_of_the_view_and_a_click_travels(app):
    viewer = app.viewer
    app.resize((900, 900), 1.0)  # the whole section has room
    app.panels.opened |= dict.fromkeys(app.panels.opened, False) | {"Camera": True}
    for _ in range(3):
        listen(app)
    left, top, right, bottom = app.gui.widgets.places["overview"]
    east, north = viewer.scene.heightmap.extent_m
    assert right - left == pytest.approx((bottom - top) * east / north, abs=2)
    size = viewer.window.size
    for place, (x, y) in zip(outline(viewer.scene.controller, size), [(0, size[1]), (size[0], size[1])], strict=False):
        if viewer.pointer.place_under(x, y) is not None:
            assert np.allclose(place, viewer.pointer.place_under(x, y), atol=1.0)
    at = left + 0.3 * (right - left), top + 0.7 * (bottom - top)
    app.mouse_move(*at)
    later(app, 0.1)
    app.mouse_down("left", *at)
    later(app, 0.1)
    app.mouse_up("left", *at)
    settle(app)
    target = viewer.scene.controller.ground_at(0.0, 0.0)
    assert target is not None
    middle = viewer.pointer.place_under(0.5 * (size[0] + viewer.window.panel_px), 0.5 * size[1])
    assert math.dist(middle[:2], (0.3 * east, 0.3 * north)) < 0.1 * east
