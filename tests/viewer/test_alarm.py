"""The window's alarm: a picture whose achieved error is above its certified bound is marked and reported."""

import json

import numpy as np
from viewers import later, seen, settle, texts

from terrain_gl.viewer.alarm import broken_sides
from terrain_gl.viewer.commands import press


def break_the_tables(app):
    """Overwrite the counters: the tables then promise that no cell has an error."""
    app.viewer.scene.renderer.tables.counters.clear()
    app.viewer.painter.forget()
    settle(app)


def red_rim(app):
    """The share of reddish pixels along the rim of the window."""
    picture = seen(app)
    rim = np.concatenate([picture[1], picture[-2], picture[:, 1], picture[:, -2]])
    return ((rim[:, 0] > 150) & (rim[:, 0] > 1.5 * rim[:, 1])).mean()


def test_a_kept_promise_is_not_mentioned(app, tmp_path):
    app.viewer.alarm.folder = tmp_path / "reports"
    settle(app)
    assert app.viewer.painter.frame.measured_px and "PROMISE" not in texts(app)
    assert red_rim(app) == 0 and not (tmp_path / "reports").exists()


def test_a_broken_promise_is_marked_and_reported(app, tmp_path):
    app.viewer.alarm.folder = tmp_path / "reports"
    app.viewer.window.say("something happened before")
    break_the_tables(app)
    frame = app.viewer.painter.frame
    assert frame.achieved_px > frame.certified_px
    words = f"PROMISE BROKEN: achieved {frame.achieved_px:.3f} px, certified {frame.certified_px:.3f} px"
    assert words in texts(app) and red_rim(app) > 0.5
    (path,) = (tmp_path / "reports").iterdir()
    assert str(path) in texts(app)
    report = json.loads(path.read_text())
    assert report["broken"][0]["achieved_px"] == frame.achieved_px and report["gl"]["GL_RENDERER"]
    assert report["camera"]["eye"] == list(app.viewer.scene.frame_spec().camera.eye)
    assert report["options"][0]["max_error_px"] == 1 and report["map"]["posts"] == [129, 129]
    assert report["messages"][-1] == "something happened before"


def test_one_picture_has_one_report_and_the_next_picture_a_new_one(app, tmp_path):
    app.viewer.alarm.folder = tmp_path / "reports"
    break_the_tables(app)
    settle(app)
    later(app)
    assert len(list((tmp_path / "reports").iterdir())) == 1
    press(app.viewer, "home")
    app.viewer.scene.controller.look(10, 0)
    settle(app)
    assert len(list((tmp_path / "reports").iterdir())) == 2


def test_a_folder_that_cannot_be_written_is_told(app, tmp_path):
    (tmp_path / "reports").write_text("a file, no folder")
    app.viewer.alarm.folder = tmp_path / "reports"
    break_the_tables(app)
    assert "no report could be written" in texts(app)


def test_sides_are_compared_by_their_own_metric():
    good = {"certified_max_error_px": 1.0, "certified_metric": "rms"}
    bad = {"certified_max_error_px": 1.0, "certified_metric": "max"}
    achieved = {"max": 1.5, "rms": 0.9}
    assert [each.side for each in broken_sides([good, bad], [achieved, achieved])] == [1]
    assert broken_sides([{**bad, "certified_max_error_px": None}], [achieved]) == []
    assert broken_sides([bad], []) == []
