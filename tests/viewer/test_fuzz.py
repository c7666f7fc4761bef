"""Nothing that mouse, keyboard or window system can do ends the program or loses a stroke."""

import os
import subprocess
import sys

import numpy as np
import pytest
from fuzz import Fuzz
from viewers import hills, later, seen, set_budget, settle, slow, texts, with_a_stroke

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.camera import Camera
from terrain_gl.heightmap import Heightmap
from terrain_gl.renderer import Renderer
from terrain_gl.viewer.loading import Opened
from terrain_gl.viewer.recovery import lost_land, offer_of


@pytest.mark.slow
def test_random_events_break_nothing(ctx, make_app, folder):
    app = make_app((320, 200), with_map=False)
    heightmap = hills(33)
    app.viewer.show(Renderer(heightmap, (80, 50), ctx=ctx), Opened(heightmap, Camera.default(heightmap), key="hills"))
    set_budget(app.viewer, slow())
    Fuzz(app, 35, asks_disk=False).run(500)


def test_a_window_that_is_narrower_than_its_panel_is_split(app):
    app.resize((3, 3), 1.0)
    settle(app)
    app.press("t")
    settle(app)
    settings = app.viewer.settings
    assert settings.split and 0 < settings.divider < 1 and app.viewer.ctx.error == "GL_NO_ERROR"


def fails(*arguments, **named):
    raise ValueError("a mistake")


@pytest.mark.slow
@pytest.mark.parametrize("part", ["painter.step", "painter.canvas.show", "mouse.move", "saver.step"])
def test_an_error_is_shown_in_a_line_and_the_program_goes_on(app, monkeypatch, part):
    before = seen(app)
    *owners, name = part.split(".")
    owner = app.viewer
    for each in owners:
        owner = getattr(owner, each)
    with monkeypatch.context() as broken:
        broken.setattr(owner, name, fails)
        app.attempt(app.mouse_move, 600, 300)  # as window and notebook do
        app.viewer.window.refresh()
        later(app, 0.1)
        later(app, 0.1)
        assert "an error in the program: ValueError: a mistake" in texts(app)
        assert app.busy is False and app.wait_s >= 0.25 or part == "mouse.move"
    app.expected = list(app.errors)
    app.viewer.window.say("")
    app.press("tab")
    settle(app)
    app.press("shift+tab")
    settle(app)
    assert app.errors == app.expected and len(app.errors) >= 1
    assert np.mean(seen(app)[:450, 450:] != before[:450, 450:]) < 0.02  # below are messages


def test_panels_that_fail_leave_the_message(app, monkeypatch):
    with monkeypatch.context() as broken:
        broken.setitem(app.panels._sections, "Detail", (fails, ""))  # in the middle of a window, in a child of it
        app.viewer.window.refresh()
        later(app, 0.1)
        later(app, 0.1)
        assert "an error in the program: ValueError: a mistake" in texts(app)
    app.expected = list(app.errors)
    settle(app)
    assert "tolerance" in app.gui.widgets.places and app.errors == app.expected


def test_an_error_keeps_the_strokes_in_a_file(make_app, monkeypatch, tmp_path):
    app = make_app((320, 200))
    app.viewer.sculpting.recovery.folder = tmp_path / "recovered"
    _, sculpted = with_a_stroke(app.viewer)
    monkeypatch.setattr(app.viewer.painter, "step", fails)
    later(app, 0.01)
    app.expected = list(app.errors)
    kept = app.viewer.sculpting.recovery.path
    app.viewer.sculpting.join()
    assert str(kept) in app.viewer.window.message
    assert np.array_equal(Heightmap.open(kept).heights, sculpted)
    assert Heightmap.open(kept).spacing_m == (10.0, 10.0)
    assert "a mistake" in (tmp_path / "recovered" / "errors.txt").read_text()


def test_strokes_are_kept_while_the_program_runs_and_until_they_are_saved(make_app, tmp_path):
    app = make_app((320, 200))
    sculpting = app.viewer.sculpting
    sculpting.recovery.folder = tmp_path
    _, sculpted = with_a_stroke(app.viewer)
    later(app, 5.0)
    sculpting.join()
    (kept,) = tmp_path.iterdir()
    assert np.array_equal(Heightmap.open(kept).heights, sculpted) and lost_land(tmp_path) == []
    ended = subprocess.run([sys.executable, "-c", "import os; print(os.getpid())"], capture_output=True, text=True)
    lost = kept.rename(tmp_path / kept.name.replace(str(os.getpid()), ended.stdout.strip()))
    assert lost_land(tmp_path) == [lost] and str(lost) in offer_of(lost)
    lost.rename(kept)
    sculpting.undo()
    later(app, 5.0)
    assert list(tmp_path.iterdir()) == []
    sculpting.redo()
    later(app, 5.0)
    sculpting.join()
    assert kept.exists()
    sculpting.save(str(tmp_path / "mine.tif"))
    settle(app)
    assert not kept.exists()


def test_a_user_who_leaves_without_saving_leaves_no_file(make_app, tmp_path):
    app = make_app((320, 200))
    app.viewer.sculpting.recovery.folder = tmp_path
    with_a_stroke(app.viewer)
    later(app, 5.0)
    app.viewer.sculpting.join()
    assert len(list(tmp_path.iterdir())) == 1
    for _ in range(2):
        app.viewer.quit()
    assert app.viewer.window.closing
    app.viewer.sculpting.recovery.remove()  # what `close` does
    assert list(tmp_path.iterdir()) == []


def test_without_a_map_an_error_ends_the_program(make_app):
    app = make_app(with_map=False)
    with pytest.raises(TerrainError, match="no map"):
        app.attempt(lambda: (_ for _ in ()).throw(TerrainError("no map")))
    assert app.errors == []
