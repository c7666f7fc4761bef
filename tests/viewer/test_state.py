"""What the window remembers from one run to the next."""

import json
from dataclasses import asdict

import pytest
from viewers import hills

from terrain_gl.camera import Camera
from terrain_gl.renderer import Renderer
from terrain_gl.renderer.options import FrameOptions
from terrain_gl.viewer.commands import press
from terrain_gl.viewer.loading import Opened
from terrain_gl.viewer.memory import Memory
from terrain_gl.viewer.pose import Pose
from terrain_gl.viewer.recovery import state_path
from terrain_gl.viewer.settings import Settings
from terrain_gl.viewer.viewer import Viewer


def test_memory_comes_back(tmp_path):
    pose = Pose((1.0, 2.0, 3.0), 4.0, 5.0, 60.0)
    memory = Memory(tmp_path / "deep" / "view.json")
    state = {"view": asdict(pose), "sides": [{"style": "lod"}], "divider": 0.5, "frozen": None, "sums": False}
    memory.window = (800, 600)
    memory.note(Settings(panel=False, ui_scale=2.0), FrameOptions(2.5, style="lod", sun=(1, 2)))
    memory.note_map("hills", pose, {3: state}, "green")
    memory.save()
    again = Memory(tmp_path / "deep" / "view.json")
    assert memory.complaint == again.complaint == ""
    assert (again.window, again.panel, again.ui_scale) == ((800, 600), False, 2.0)
    assert again.options == {"max_error_px": 2.5, "metric": "max", "method": "sat", "style": "lod"}
    assert again.bookmarks("hills") == {3: json.loads(json.dumps(state))} and again.last_pose("hills") == pose
    assert again.look("hills") == "green" and again.look("other") is None
    assert again.bookmarks("other") == {} and again.last_pose("other") is None


@pytest.mark.parametrize(
    "text",
    ["", "{", "[]", "null", "\0\xff", '{"window": [1, "x"], "drawing": {"style": 5}, "panels": 3, "maps": []}']
    + ['{"window": [1e999, 0], "drawing": {"max_error_px": "much"}, "maps": {"hills": {"pose": [1, 2]}}}']
    + ['{"maps": {"hills": {"states": 7, "pose": [1e99, 0, 0, 0, 0, 0]}}}', '{"drawing": {"max_error_px": -1}}']
    + ['{"maps": {"hills": {"states": {"1": {"view": {"eye": [NaN]}}}}}}']
    + [
        '{"ui_scale": BIG, "maps": {"hills": {"states": {"1": {"view": {"eye": [BIG, 0, 0]}}}}}}'.replace(
            "BIG", "9" * 400
        )
    ],
)
def test_a_damaged_memory_is_ignored(tmp_path, text):
    path = tmp_path / "view.json"
    path.write_text(text, "latin-1")
    memory = Memory(path)
    assert (memory.window, memory.options, memory.panel) == (None, {}, True)
    assert (memory.bookmarks("hills"), memory.last_pose("hills")) == ({}, None)
    assert text.startswith('{"') or (len(memory.complaint.splitlines()) == 1 and "ignored" in memory.complaint)
    memory.window = (640, 480)
    memory.save()
    assert Memory(path).window == (640, 480)


def test_a_memory_that_cannot_be_written_complains_in_a_line(tmp_path):
    (tmp_path / "file").write_text("")
    memory = Memory(tmp_path / "file" / "view.json")
    memory.save()
    assert "not saved" in memory.complaint and len(memory.complaint.splitlines()) == 1


def test_memory_is_in_the_state_folder_of_the_desktop(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    assert state_path() == tmp_path / "terrain-gl" / "view.json"
    monkeypatch.delenv("XDG_STATE_HOME")
    monkeypatch.setenv("HOME", "/home/someone")
    assert str(state_path()) == "/home/someone/.local/state/terrain-gl/view.json"


def test_a_map_is_shown_again_as_it_was_left(ctx, target, tmp_path):
    heightmap, framebuffer = hills(), target((32, 20))
    opened = Opened(heightmap, Camera.default(heightmap), key="hills")
    poses = []
    for _ in range(2):
        viewer = Viewer(ctx, framebuffer, (32, 20), Settings(), Memory(tmp_path / "view.json"))
        viewer.show(Renderer(heightmap, (32, 20), ctx=ctx), opened)
        poses.append(viewer.scene.controller.pose)
        viewer.scene.controller.look(100, 20)
        press(viewer, "ctrl+2")
        poses.append(viewer.scene.controller.pose)
        viewer.close()
    assert poses[2] == poses[1] != poses[0]
    kept = Memory(tmp_path / "view.json").bookmarks("hills")[2]["view"]
    assert Pose.read(kept) == poses[3]
