"""The next station of a lecture is drawn while the present one is at rest."""

import numpy as np
import pytest
from viewers import later, listen, seen, set_budget, settle, slow

from terrain_gl.viewer.lecture import _station

LOW = {"from": "first", "ahead": 0.15}


def stations(*others):
    plain = {"says": [], "asks": "?", "sides": [{"style": "lod", "max_error_px": 8}]}
    return [_station({"name": str(i)} | plain | other, "test") for i, other in enumerate(({}, *others))]


def arrive(app):
    """Press the key for the next station, and do frames until the camera has arrived."""
    app.key_down("space", "space")
    later(app, 0.1)
    while app.viewer.scene.controller.moving:
        later(app, 0.3)


def is_complete(viewer):
    return viewer.settled and viewer.painter.is_measured and viewer.lecture.shows_all


SPLIT = {"view": LOW, "sides": [{"style": "lambert", "max_error_px": 8}, {"style": "error", "max_error_px": 2}]}
FITS = {"view": LOW, "fits": True, "sides": [{"style": "error", "max_error_px": 4}]}
JUMPS = {"view": LOW, "before": "first", "sides": [{"style": "lambert", "max_error_px": 16}]}


SLOW = [pytest.param(each, marks=pytest.mark.slow, id=name) for each, name in ((FITS, "fits"), (JUMPS, "jumps"))]


@pytest.mark.parametrize("station", [pytest.param(SPLIT, id="split"), *SLOW])
def test_the_next_station_is_complete_when_the_camera_arrives(app, station):
    viewer = app.viewer
    set_budget(viewer, slow())
    viewer.give_lecture(stations(station))
    settle(app)
    assert viewer.painter.ahead.done and not viewer.painter.ahead.is_due
    arrive(app)
    later(app, 0.0)
    assert is_complete(viewer)
    drawn, numbers = seen(app), (viewer.painter.side_measured, viewer.settings.sides, viewer.lecture.jumps.sides)
    viewer.painter.forget()
    viewer.lecture.jumps.follow(viewer.lecture.jumps._before)
    settle(app)
    assert np.array_equal(seen(app), drawn)  # as without
    assert (viewer.painter.side_measured, viewer.settings.sides) == numbers[:2]
    assert [jumps.largest_px for jumps in viewer.lecture.jumps.sides] == [jumps.largest_px for jumps in numbers[2]]
    # without the picture that was drawn ahead, the station takes longer
    app.key_down("left", "left")
    settle(app)
    viewer.painter.ahead.forget()
    viewer.lecture._scales.clear()
    arrive(app)
    later(app, 0.0)
    assert not is_complete(viewer)


def begin_ahead(app):
    """Go on until the next station is being drawn, and not yet complete."""
    viewer = app.viewer
    viewer.window.refresh()
    while not (viewer.painter.ahead._steps and viewer.painter.ahead._other.drawn):
        later(app)
    for _ in range(4):
        later(app, 0.0)
    assert viewer.painter.ahead._steps


@pytest.mark.parametrize("apart", [True, False], ids=["on targets of its own", "over the picture"])
def test_lines_over_the_present_picture_stay_while_the_next_is_drawn(app, monkeypatch, apart):
    """Their parts behind hills are faint, by the depths of the present picture."""
    viewer = app.viewer
    set_budget(viewer, slow())
    frozen = {"view": {"from": "first", "ahead": -0.4, "up": 0.3}, "frozen": LOW}
    first = {"says": [], "asks": "?", "name": "", "sides": [{"style": "lambert"}], **frozen}
    viewer.give_lecture([_station(first, "test"), *stations(SPLIT)])
    while not (viewer.settled and viewer.painter.is_measured):
        later(app)
    viewer.draw()
    before = seen(app)
    if not apart:
        monkeypatch.setattr(viewer.scene.renderer, "exchange", lambda other: setattr(other, "drawn", other))
    begin_ahead(app)
    viewer.draw()
    assert np.array_equal(seen(app), before) is apart


def test_what_the_user_does_meanwhile_comes_first(app):
    viewer = app.viewer
    set_budget(viewer, slow())
    viewer.give_lecture(stations(SPLIT))
    begin_ahead(app)
    app.press("+")
    later(app, 0.0)
    assert viewer.painter.drawn == viewer.scene.frame_spec() and not viewer.painter.ahead._steps
    settle(app)
    assert viewer.painter.ahead.done  # then it is drawn after all
    drawn = seen(app)
    viewer.painter.forget()
    settle(app)
    assert np.array_equal(seen(app), drawn)


def test_another_land_or_size_is_drawn_anew(app):
    viewer = app.viewer
    viewer.give_lecture(stations(SPLIT))
    settle(app)
    ahead = viewer.painter.ahead
    assert ahead.done
    viewer.painter.forget()
    assert not ahead.done
    settle(app)
    before = ahead.done
    app.resize((800, 600), 1.0)
    settle(app)
    assert ahead.done != before and ahead.done.size == (800, 600)
    app.press("escape")
    settle(app)
    assert not ahead.is_due
    listen(app)
