"""A real window under Xvfb, with real events."""

import json
import os
import shutil
import subprocess
import sys

import numpy as np
import pytest
from screen import Screen, end_of, own_lines
from viewers import changed, hills, load

CLEAN = 0, "GL_NO_ERROR", []

_RUN = """
import sys
import numpy as np
from terrain_gl import viewer
from terrain_gl.heightmap import Heightmap
from terrain_gl.viewer.window import Window
close = Window.close
def telling_close(self):
    print(self.ctx.error)
    close(self)
Window.close = telling_close
viewer.run(Heightmap(np.load(sys.argv[1]), 10.0, "hills"), size=(640, 480), style="lambert")
"""


_CLOSE = """
import sys
from terrain_gl.viewer import window
from terrain_gl.viewer.loading import file_opener
class Hasty(window.Window):
    def _turn(self):
        super()._turn()
        now_s = self._glfw.get_time()
        if now_s > float(sys.argv[2]):
            assert self._app.viewer.loader.job or now_s > 60, "already loaded"
            self._glfw.set_window_should_close(self._handle, True)
    def close(self):
        print(self.ctx.error)
        super().close()
window.Window = Hasty
window.run(file_opener(sys.argv[1]), size=(320, 240), fresh=True)
"""


# writes the state of the viewer to a file each turn; a file named `drop` is dropped on the window
_TELL = """
import json, os, sys
import numpy as np
from terrain_gl.heightmap import Heightmap
from terrain_gl.viewer import window
class Telling(window.Window):
    def _turn(self):
        super()._turn()
        if os.path.exists("drop"):
            os.remove("drop")
            self._app.drop(os.path.abspath("dropped.npy"), 200, 150)
        viewer = self._app.viewer
        scene, frame = viewer.scene, viewer.painter.frame
        state = {"busy": viewer.busy, "message": viewer.window.message, "recording": viewer.saver.filming.running}
        if scene.has_map:
            state |= {"name": frame.name, "sides": len(viewer.settings.sides)}
            state |= {"frozen": bool(scene.frozen), "explained": bool(viewer.explainer.explanation)}
            state |= {"strokes": viewer.sculpting.tool.strokes}
            state |= {"eye": list(scene.controller.eye), "mode": scene.controller.mode, "size": viewer.window.size}
            state |= {"measured": frame.measured_px, "bound": frame.certified_px, "fov": scene.controller.fov_deg}
            state |= {"speed": scene.controller.speed_m_s, "pivot": scene.controller.pivot is not None}
            place = viewer.pointer.place_under(160, 180)
            state |= {"moving": scene.controller.moving, "place": [] if place is None else list(place)}
        with open("state.part", "w") as file:
            json.dump(state, file)
        os.replace("state.part", "state.json")
    def close(self):
        print(self.ctx.error)
        super().close()
window.Window = Telling
window.run(Heightmap(np.load("hills.npy"), 10.0, "hills"), size=(700, 420), fresh=True, panel=False)
"""


@pytest.fixture(scope="module")
def screen(tmp_path_factory):
    for program in ("Xvfb", "xdotool"):
        if not shutil.which(program):
            pytest.skip(f"no {program} here; apt install {program.lower()}")
    screen = Screen(tmp_path_factory.mktemp("screen"))
    yield screen
    screen.server.terminate()
    screen.server.wait()


def has_panel(screen):
    """Whether the panel at the left is there: sliders and graphs have orange parts."""
    return (is_orange(screen.pixels()[:, 15:200]).sum(1) > 5).sum() > 8


def has_page_of_keys(screen):
    """Whether the page of keys is in the middle of a window of 640 x 480: dark, orange keys, white words beside them.

    The land below it may change at any time: styles, levels and light arrive later than the keys that ask for them.
    """
    page = screen.pixels()[100:440, 126:500]
    keys, words = page[:, :100], page[:, 115:]
    is_dark = np.median(page.max(-1)) < 80
    return is_dark and (is_orange(keys).sum(1) > 5).sum() > 50 and ((words.min(-1) > 180).sum(1) > 5).sum() > 50


def is_orange(pixels):
    return (pixels[..., 0] > 150) & (pixels[..., 2] < 130)


@pytest.mark.slow
def test_window(screen, tmp_path):
    np.save(tmp_path / "hills.npy", hills().heights)
    with screen.running("-c", _RUN, "hills.npy", cwd=tmp_path) as process:
        screen.wait(lambda: has_panel(screen), "the first picture")
        screen.do("search", "--sync", "--name", "hills", "windowfocus")
        pictures = [tmp_path / f"hills-{number:03d}.png" for number in (1, 2, 3, 4, 5)]

        def picture(number):
            screen.do("key", "p")
            screen.wait(pictures[number].exists, pictures[number].name)
            return load(pictures[number])

        first = picture(0)
        assert first.shape[:2] == (480, 640) and first.std() > 5

        beside = np.s_[:400, 350:640]  # of words over the picture
        screen.wait(lambda: np.array_equal(screen.pixels()[beside], first[beside]), "the picture that was saved")
        screen.do("click", "--repeat", 5, 4, "keydown", "w")
        screen.wait(lambda: changed(screen.pixels()[beside], first[beside]) > 0.05, "motion")
        screen.do("keyup", "w")
        flown = picture(1)
        assert changed(flown, first) > 0.02

        screen.do("mousemove", 320, 300, "mousedown", 1, "mousemove", 380, 310, "mouseup", 1)
        screen.do("mousemove", 320, 240, "mousedown", 3, "mousemove", 300, 240, "mouseup", 3, "click", 5)
        screen.do("key", "plus", "key", "m", "key", "Tab", "key", "Tab", "key", "Tab")
        turned = picture(2)
        assert changed(turned, flown) > 0.2

        screen.do("key", "h")
        screen.wait(lambda: has_page_of_keys(screen), "the keys")
        screen.do("key", "h")
        screen.wait(lambda: not has_page_of_keys(screen), "the land again")
        screen.do("key", "minus", "key", "m", *["key", "shift+Tab"] * 3, "key", "Home")
        assert np.array_equal(picture(3), first)

        screen.do("search", "--name", "hills", "windowsize", 500, 300)
        screen.wait(lambda: screen.pixels()[310:, 510:].max() == 0, "the smaller window")
        assert picture(4).shape[:2] == (300, 500)
        panel, land = np.s_[20:280, 15:200], np.s_[20:280, 260:490]
        screen.wait(
            lambda: screen.pixels()[panel].mean() < 100 < screen.pixels()[land].mean(), "a dark panel beside the land"
        )

        screen.do("key", "Escape", "key", "Escape")
        assert end_of(process) == CLEAN


@pytest.mark.slow
def test_a_run_with_real_events(screen, tmp_path):
    """Fly, sculpt, split, freeze, record, open a dropped file, and quit; no OpenGL error."""
    np.save(tmp_path / "hills.npy", hills().heights)
    np.save(tmp_path / "dropped.npy", np.add.outer(np.arange(50.0), np.arange(40.0)))
    with screen.running("-c", _TELL, cwd=tmp_path) as process:

        def state():
            path = tmp_path / "state.json"
            return json.loads(path.read_text()) if path.exists() else {}

        def does(condition, *words):
            if words:
                screen.do(*words)
            screen.wait(lambda: process.poll() is None and condition(state()), words)

        does(lambda s: s.get("measured"))
        screen.do("search", "--sync", "--name", "hills", "windowfocus")
        start = state()["eye"]
        does(lambda s: s["eye"] != start, "keydown", "w", "sleep", 0.3, "keyup", "w")
        does(lambda s: s["recording"], "key", "r")
        does(lambda s: s["mode"] == "orbit", "key", "v")
        screen.do("keydown", "w", "sleep", 0.6, "keyup", "w")
        does(lambda s: not s["recording"], "key", "r")
        film, pictures = tmp_path / "hills-001.mp4", tmp_path / "hills-001"
        screen.wait(
            lambda: (film.exists() or pictures.is_dir()) and not state()["busy"], "the film, or a folder of pictures"
        )
        does(lambda s: s["mode"] == "walk", "key", "v")
        does(lambda s: s["mode"] == "fly", "key", "Home")
        does(lambda s: not s["moving"])
        before = state()
        does(lambda s: s["eye"][2] < 0.9 * before["eye"][2], "mousemove", 160, 180, "click", "--repeat", 2, 4)
        assert np.allclose(state()["place"], before["place"], atol=2.0)  # is still under the cursor
        does(lambda s: np.allclose(s["eye"], before["eye"], atol=2.0), "click", "--repeat", 2, 5)
        does(lambda s: s["fov"] < before["fov"], "keydown", "ctrl", "click", 4, "keyup", "ctrl")
        does(lambda s: s["fov"] > 0.99 * before["fov"], "keydown", "ctrl", "click", 5, "keyup", "ctrl")
        does(lambda s: s["speed"] > 1.2 * before["speed"], "keydown", "shift", "click", 4, "keyup", "shift")
        held = state()["eye"]
        screen.do("mousemove", 160, 180, "mousedown", 2, "mousemove", 200, 180, "mousemove", 220, 190, "mouseup", 2)
        does(lambda s: s["eye"][0] < held[0] - 1 and s["eye"][2] == held[2])
        panned = state()["eye"]
        does(
            lambda s: not s["moving"] and s["eye"][2] < 0.8 * panned[2],
            *("mousemove", 160, 180, "click", "--repeat", 2, "--delay", 60, 1),
        )
        assert not state()["explained"]
        does(lambda s: s["eye"] == start, "key", "Home")
        does(lambda s: s["explained"], "mousemove", 160, 180, "click", 1)
        does(lambda s: "brush" in s["message"], "key", "b")
        screen.do("mousemove", 140, 180, "mousedown", 1, "mousemove", 180, 185, "sleep", 0.2, "mouseup", 1)
        does(lambda s: s["strokes"] == [1, 0])
        does(lambda s: s["measured"] and s["measured"]["max"] <= s["bound"] <= 1)
        screen.do("search", "--sync", "--name", r"^hills\*")
        does(lambda s: s["strokes"] == [0, 1], "key", "ctrl+z")
        screen.do("search", "--sync", "--name", "^hills .*terrain-gl")
        does(lambda s: s["strokes"] == [1, 0], "key", "ctrl+shift+z")
        does(lambda s: s["sides"] == 2, "key", "b", "key", "t")
        does(lambda s: s["frozen"], "key", "l")
        does(lambda s: not s["frozen"] and s["sides"] == 1, "key", "l", "key", "t")
        does(lambda s: "bookmark 4" in s["message"], "key", "ctrl+4")
        does(lambda s: s["size"] == [260, 200], "search", "--name", "hills", "windowsize", 260, 200)
        (tmp_path / "drop").write_text("")
        does(lambda s: "not saved" in s["message"] and s["name"] == "hills")
        (tmp_path / "drop").write_text("")
        does(lambda s: s["name"] == "dropped.npy" and not s["busy"])
        screen.do("search", "--sync", "--name", "dropped.npy")
        screen.do("key", "ctrl+q")
        assert end_of(process) == CLEAN
    assert list(tmp_path.glob("hills-001*"))  # the film, or a folder of pictures


@pytest.mark.slow
def test_a_file_from_a_file_manager(screen, tmp_path):
    """Files are dropped by the protocol of the X server."""
    pytest.importorskip("Xlib", reason="no python-xlib here, to drop files with: pip install python-xlib")
    from xdnd import drop

    np.save(tmp_path / "hills.npy", hills().heights)
    dropped = tmp_path / "dropped % ä.npy"
    np.save(dropped, np.add.outer(np.arange(50.0), np.arange(40.0)))
    with screen.running("-c", _TELL, cwd=tmp_path) as process:
        state = tmp_path / "state.json"
        screen.wait(lambda: state.exists() and json.loads(state.read_text()).get("measured"), "the first map")
        assert drop(screen.environment["DISPLAY"], (200, 150), [dropped])
        screen.wait(lambda: json.loads(state.read_text())["name"] == dropped.name, "the map that was dropped")
        (tmp_path / "broken.tif").write_text("no map")
        assert drop(screen.environment["DISPLAY"], (200, 150), [tmp_path / "broken.tif"])
        screen.wait(lambda: "broken.tif" in json.loads(state.read_text())["message"], "a line about what is no map")
        assert json.loads(state.read_text())["name"] == dropped.name
        screen.do("search", "--sync", "--name", "dropped", "windowfocus")
        screen.do("key", "ctrl+q")  # not to this window: when the key goes up, the window may have gone
        assert end_of(process) == CLEAN


@pytest.mark.slow
def test_view_command(screen, tmp_path):
    """Without the panel at first; a key shows it."""
    options = ["--size", "480x360", "--fresh", "--plain", "--json", "last.json", "--backend", "egl"]
    with screen.running("-m", "terrain_gl", "view", *options, cwd=tmp_path) as process:
        screen.wait(lambda: screen.pixels()[50:300, 50:430].std() > 20, "the first picture")
        assert not has_panel(screen)
        screen.do("search", "--sync", "--name", "terrain-gl", "windowfocus", "key", "i")
        screen.wait(lambda: has_panel(screen), "the panel")
        screen.do("key", "ctrl+q")
        assert end_of(process) == (0, "", [])
    last = json.loads((tmp_path / "last.json").read_text())
    assert last["map"] == "alpine" and last["triangles"] > 100


@pytest.mark.slow
def test_panels_in_a_window(screen, tmp_path):
    pytest.importorskip("imgui_bundle", reason="the extra [gui] is not installed")
    command = ["-m", "terrain_gl", "view", "canyon-15m", "--size", "640x480", "--fresh", "--json", "last.json"]
    with screen.running(*command, cwd=tmp_path) as process:
        screen.wait(lambda: 0 < screen.pixels()[14:40, 10:280].mean() < 60, "the panel's title")
        screen.do("search", "--sync", "--name", "terrain-gl", "windowfocus")
        screen.wait(lambda: screen.pixels()[200:470, 350:630].std() > 20, "the picture")
        screen.wait(lambda: has_panel(screen), "sliders")
        rows = np.flatnonzero(is_orange(screen.pixels()[:, 15:200]).sum(1) > 5)
        knob = slice(rows[0] - 2, rows[0] + 14)  # the first slider is the tolerance
        assert not is_orange(screen.pixels()[knob, 145:160]).any()
        screen.do("mousemove", 150, rows[0] + 6, "click", 1, "mousemove", 500, 300)
        screen.wait(lambda: is_orange(screen.pixels()[knob, 145:160]).any(), "the slider's knob")
        screen.wait(lambda: screen.is_at_rest(process), "a picture at rest: in motion the mesh is looser")
        screen.do("key", "ctrl+q")
        assert end_of(process) == (0, "", [])
    last = json.loads((tmp_path / "last.json").read_text())
    assert last["requested_max_error_px"] > 3 and last["certified_max_error_px"] <= last["requested_max_error_px"]


@pytest.mark.slow
@pytest.mark.parametrize("waited_s", [0.3, 0.7, 1.1])
def test_closing_during_a_load_exits_cleanly(screen, tmp_path, waited_s):
    np.save(tmp_path / "large.npy", np.add.outer(np.arange(3000.0) % 17, np.arange(2800.0) % 23).astype("f4"))
    with screen.running("-c", _CLOSE, "large.npy", waited_s, cwd=tmp_path) as process:
        assert end_of(process) == CLEAN


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [(["gone.tif"], 1, "gone.tif"), (["nothing"], 1, "bundled"), (["--backend", "osmesa"], 2, "egl")],
)
def test_bad_arguments_give_one_line(screen, tmp_path, arguments, status, words):
    with screen.running("-m", "terrain_gl", "view", *arguments, cwd=tmp_path) as process:
        code, output, errors = end_of(process)
    assert (code, output, len(errors)) == (status, "", 1) and words in errors[0]


def test_without_a_display():
    environment = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}
    command = [sys.executable, "-m", "terrain_gl", "view", "canyon-15m"]
    result = subprocess.run(command, env=environment, text=True, capture_output=True)
    assert (result.returncode, result.stdout, len(result.stderr.splitlines())) == (1, "", 1)
    assert "display" in result.stderr and "terrain-gl shot" in result.stderr


def test_lines_of_the_driver_are_not_ours():
    driver = (
        "libEGL warning: DRI3 error: Could not get DRI3 device\nlibEGL warning: Ensure your X server supports DRI3\n"
    )
    ours = "terrain-gl: gone.tif: no such file\nTraceback (most recent call last):\n"
    assert own_lines(driver) == [] and own_lines(driver + ours) == ours.splitlines()
