"""The file dialog: the list in the window, and the system's own."""

import os
import stat
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from viewers import later, settle

from terrain_gl.viewer import file_dialog
from terrain_gl.viewer.file_dialog import FileDialog, maps_in
from terrain_gl.viewer.window_state import WindowState


@pytest.fixture
def maps(tmp_path):
    (tmp_path / "deep").mkdir()
    for name in ("B.npy", "a.npy", "deep/c.npy", "notes.txt", ".hidden.npy"):
        np.save(tmp_path / "x.npy", np.add.outer(np.arange(40.0), np.arange(30.0)))
        (tmp_path / "x.npy").rename(tmp_path / name)
    return tmp_path


def test_folders_come_first_and_only_maps_are_listed(maps):
    assert maps_in(maps) == (["../", "deep/", "a.npy", "B.npy"], "")
    entries, words = maps_in(maps / "gone")
    assert entries == ["../"] and "gone" in words and "\n" not in words


def listed(app):
    """Labels of the controls that are shown."""
    return app.gui.widgets.places


def click(app, label):
    left, top, right, bottom = app.gui.widgets.places[label]
    for down in (True, False):
        app.mouse_move(left + 20, (top + bottom) / 2)
        (app.mouse_down if down else app.mouse_up)("left", left + 20, (top + bottom) / 2)
        later(app, 0.1)
    app.viewer.files.join()
    settle(app)


def test_a_map_is_chosen_from_the_list(app, maps, monkeypatch):
    monkeypatch.chdir(maps)
    app.viewer.files = FileDialog(app.viewer.window, app.viewer.open)
    app.press("ctrl+o")
    app.viewer.files.join()
    settle(app)
    assert "a.npy" in listed(app) and not any("notes" in name for name in listed(app))
    click(app, "deep/")
    assert "c.npy" in listed(app) and "a.npy" not in listed(app)
    app.press("escape")
    settle(app)
    assert "c.npy" not in listed(app) and not app.viewer.window.closing
    app.press("ctrl+o")
    app.viewer.files.join()
    settle(app)
    click(app, "B.npy")
    assert app.viewer.painter.frame.name == "B.npy" and app.viewer.files.folder is None


def test_a_slow_folder_blocks_nothing(app, monkeypatch):
    read = threading.Event()
    monkeypatch.setattr(file_dialog, "maps_in", lambda folder: read.wait(60) and (["late.npy"], ""))
    app.press("ctrl+o")
    for _ in range(3):
        later(app, 0.1)
    assert app.viewer.files.entries is None and app.viewer.wait_s < 0.1
    read.set()
    app.viewer.files.join()
    settle(app)
    assert "late.npy" in listed(app)


def test_the_systems_dialog_answers_later(folder, monkeypatch):
    """A helper that takes its time, as a user does; the list is not opened."""
    pytest.importorskip("imgui_bundle", reason="the extra [gui] is not installed")
    helper = folder / "zenity"
    helper.write_text("#!/bin/sh\nwhile [ ! -e answered ]; do sleep 0.05; done\necho /maps/chosen.tif\n")
    helper.chmod(helper.stat().st_mode | stat.S_IEXEC)
    monkeypatch.setenv("PATH", f"{folder}{os.pathsep}{os.environ['PATH']}")
    chosen = []
    files = FileDialog(WindowState((100, 100)), chosen.append)
    files.has_desktop = True
    files.open()
    for _ in range(3):
        files.step()
    assert files.busy and files.folder is None and chosen == []
    Path("answered").touch()
    while files.busy:
        time.sleep(0.05)  # a frame
        files.step()
    assert chosen == ["/maps/chosen.tif"]


def test_without_a_helper_the_list_opens(tmp_path, monkeypatch):
    monkeypatch.setattr(file_dialog.sys, "platform", "linux")
    monkeypatch.setenv("PATH", str(tmp_path))
    files = FileDialog(WindowState((100, 100)), print)
    files.has_desktop = True
    files.open()
    assert files.folder == Path.cwd()
    assert files.close() and not files.close()
