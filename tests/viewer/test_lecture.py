"""Lectures: stations, their numbers, and states of the window as JSON."""

import json
from dataclasses import replace

import pytest
from viewers import listen, settle, texts

from terrain_gl.basics.exceptions import UsageError
from terrain_gl.viewer import state
from terrain_gl.viewer.lecture import UNKNOWN, _station, read_lecture
from terrain_gl.viewer.marks import lines_on_land
from terrain_gl.viewer.memory import Memory


def begin(app, stations=None):
    viewer = app.viewer
    viewer.give_lecture(stations)
    settle(app)


@pytest.mark.slow
def test_the_lecture_has_thirteen_stations_with_true_numbers(app):
    pytest.importorskip("zarr")  # the last station shows a store
    before = replace(app.viewer.settings, sides=list(app.viewer.settings.sides))
    app.viewer.window.resize((480, 300))
    begin(app)
    stations = app.viewer.lecture.stations
    assert len(stations) == 13
    for number, station in enumerate(stations):
        settle(app)
        told, shown = " ".join([*app.viewer.lecture.texts()[0], app.viewer.lecture.texts()[1]]), texts(app)
        assert app.viewer.lecture.number == number and station.asks.endswith("?")
        assert UNKNOWN not in told and told.split(". ")[0] in shown.replace("\n", " ")
        for stats, name in zip(app.viewer.painter.side_stats, ("{triangles}", "{triangles_right}"), strict=False):
            assert name not in "".join(station.says) or f"{stats['triangles']:,}" in told
        if "{achieved}" in "".join(station.says):
            assert f"{app.viewer.painter.side_measured[0]['max']:.3g} px" in told
        is_there = station.click != "hidden" or app.viewer.painter.side_stats[0]["patches_hidden"]
        assert bool(app.viewer.explainer.explanation) == bool(station.click and is_there)
        assert app.viewer.sculpting.brushing == station.brush and app.viewer.settings.lens == station.lens
        app.key_down("space", "space")
        assert app.viewer.lecture.number == number and app.viewer.lecture.texts()[2] in texts(app).replace("\n", " ")
        app.key_down("space", "space")
    assert app.viewer.lecture.number == 12
    app.key_down("left", "left")
    assert app.viewer.lecture.number == 11 and not app.viewer.scene.controller.held
    app.press("escape")  # the brush of this station
    app.press("escape")
    assert app.viewer.lecture.station is None and app.viewer.settings == before
    app.press("ctrl+l")
    assert app.viewer.lecture.number == 11  # it goes on
    app.viewer.lecture.end()
    assert app.viewer.settings == before
    app.key_down("left", "left")
    assert "left" in app.viewer.scene.controller.held


@pytest.mark.parametrize(
    ("station", "words"),
    [
        ({"says": ["{triangels}"]}, "triangels"),
        ({"sides": [{"styl": "lod"}]}, "styl"),
        ({"sides": [{"style": "lodd"}]}, "lodd"),
        ({"view": "nowhere"}, "nowhere"),
        ({"frozen": {"eye": [0, 0]}}, "values"),
        ({"sides": []}, "sides"),
        ({"camera": 1}, "camera"),
    ],
)
def test_a_wrong_station_is_named_in_one_line(tmp_path, station, words):
    path = tmp_path / "mine.json"
    good = {"name": "one", "says": [], "asks": "?"}
    path.write_text(json.dumps({"stations": [good, good | station]}))
    with pytest.raises(UsageError, match=f"mine.json, station 2: .*{words}") as told:
        read_lecture(str(path))
    assert "\n" not in str(told.value)


def test_tolerances_for_a_window_of_some_rows_grow_with_the_window(app):
    plain = {"name": "one", "says": [], "asks": "?", "sides": [{"max_error_px": 2}]}
    for rows, tolerance_px in ((720, 4.0), (0, 2.0)):
        app.resize((900, 1440), 1.0)
        app.viewer.give_lecture([_station(plain | {"rows": rows}, "test")])
        assert app.viewer.settings.options.max_error_px == tolerance_px


def test_the_legends_of_a_split_are_low_in_a_lecture(app):
    """The sentences are at the top, so legends there would cover the far land."""
    sides = [{"style": "lod", "max_error_px": 8}, {"style": "lod", "max_error_px": 2}]
    begin(app, [_station({"name": "one", "says": ["Look."], "asks": "?", "sides": sides}, "test")])
    for is_given in (True, False):
        for _ in range(3):
            listen(app)
        tops = [top for name, _, top, _, _ in listen(app).windows if name.startswith("##side")]
        rows = app.viewer.window.size[1]
        assert len(tops) == 2 and all((top > 0.6 * rows) is is_given for top in tops)
        kept = list(app.viewer.settings.sides)
        app.viewer.lecture.end()
        app.viewer.settings.sides = kept
        settle(app)


def test_a_file_that_is_no_lecture_is_named(tmp_path):
    for text in ("", "[]", "{}", '{"stations": [1]}'):
        (tmp_path / "mine.json").write_text(text)
        with pytest.raises(UsageError, match="mine.json: no lecture"):
            read_lecture(str(tmp_path / "mine.json"))
    with pytest.raises(UsageError, match="gone.json"):
        read_lecture(str(tmp_path / "gone.json"))


@pytest.mark.slow
def test_a_bookmark_keeps_the_whole_state(app, tmp_path):
    viewer = app.viewer
    viewer.settings.change(style="lod", max_error_px=3.0)
    app.press("l")
    app.press("ctrl+2")
    kept = json.loads(json.dumps(state.state_of(viewer.scene, viewer.layers)))
    pose, sides = viewer.scene.controller.pose, list(viewer.settings.sides)
    app.press("l")
    viewer.settings.change_all(style="lambert", max_error_px=1.0)
    app.press("t")
    viewer.scene.controller.pose = replace(pose, azimuth_deg=123.0)
    app.press("2")
    settle(app)
    there = viewer.scene.controller.pose
    assert viewer.settings.sides == sides and viewer.scene.frozen
    assert (*there.eye, there.azimuth_deg) == pytest.approx((*pose.eye, pose.azimuth_deg))
    frozen_for = viewer.scene.frame_spec().sides[0].chosen_for
    viewer.exaggerate(2.0)
    raised = viewer.scene.frame_spec().sides[0].chosen_for
    assert raised.eye == pytest.approx(frozen_for.eye) and raised.target == pytest.approx(frozen_for.target)
    lines = lines_on_land(viewer.scene, viewer.pointer, viewer.explainer, viewer.sculpting, viewer.ruler)
    assert lines[0][0][0] == pytest.approx(frozen_for.eye)  # the frustum begins there
    app.press("2")
    assert viewer.scene.exaggeration == viewer.scene.controller.exaggeration == 2.0
    settle(app)
    assert viewer.scene.controller.eye[2] == pytest.approx(2 * pose.eye[2])  # over the same land
    viewer.exaggerate(1.0)
    memory = Memory(tmp_path / "view.json")
    memory.note_map("hills", pose, viewer.scene.bookmarks, "auto")
    memory.save()
    assert Memory(tmp_path / "view.json").bookmarks("hills") == {2: kept}
    damaged = (tmp_path / "view.json").read_text().replace('"lod"', '"none"')
    (tmp_path / "view.json").write_text(damaged)
    assert Memory(tmp_path / "view.json").bookmarks("hills") == {}
