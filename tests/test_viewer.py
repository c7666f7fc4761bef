"""The viewer: what keys and mouse do to the camera, the words on the picture, and a real window under Xvfb."""

import contextlib
import math
import os
import shutil
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest

from terrain_gl.camera import Camera
from terrain_gl.heightmap import Heightmap
from terrain_gl.image import read_image
from terrain_gl.renderer import Renderer
from terrain_gl.shade import STYLES
from terrain_gl.viewer import font, hud
from terrain_gl.viewer.controller import CLEARANCE, FAST, WHEEL, Controller, ground_m, hit_ground
from terrain_gl.viewer.flight import Flight, free_name
from terrain_gl.viewer.hud import Figures, metres
from terrain_gl.viewer.overlay import Overlay, Panel, Text
from terrain_gl.viewer.settings import KEYS, STEP, Settings


def hills(posts=129, spacing_m=10.0):
    t = np.linspace(0, 3 * math.pi, posts)
    return Heightmap(60 * np.sin(t)[:, None] * np.cos(0.7 * t)[None, :] + 100, spacing_m, "hills")


@pytest.fixture
def controller():
    return Controller(hills(), Camera((640, -200, 400), (640, 640, 100)))


# --- Controller -------------------------------------------------------------------------------------------------------


def test_starts_with_the_camera_given(controller):
    assert controller.camera.eye == (640, -200, 400)
    assert np.allclose(controller.camera.axes, controller.start.axes, atol=1e-12)
    assert not controller.moving


def test_straight_down_keeps_north_up():
    start = Camera((600, 600, 900), (600, 600, 0))
    controller = Controller(hills(), start)
    assert np.allclose(controller.camera.axes, start.axes, atol=3e-3)  # a tenth of a degree from the vertical


@pytest.mark.parametrize(("key", "axis", "sign"), [("w", 2, 1), ("s", 2, -1), ("d", 0, 1), ("a", 0, -1)])
def test_keys_move_along_the_view(controller, key, axis, sign):
    before, direction = controller.eye.copy(), sign * controller.axes[axis]
    controller.press(key)
    controller.step(0.5)
    moved = controller.eye - before
    assert np.allclose(moved / np.linalg.norm(moved), direction)


@pytest.mark.parametrize(("key", "sign"), [("e", 1), ("q", -1)])
def test_keys_move_up_and_down_in_the_world(controller, key, sign):
    before = controller.eye.copy()
    controller.press(key)
    controller.step(0.2)
    assert np.allclose((controller.eye - before)[:2], 0) and (controller.eye - before)[2] * sign > 0


def test_opposite_keys_hold_still(controller):
    controller.press("w")
    controller.press("s")
    assert not controller.moving


@pytest.mark.parametrize("frames", [1, 7, 100])
def test_motion_does_not_depend_on_the_frame_rate(controller, frames):
    expected = Controller(controller.heightmap, controller.start)
    for flown, steps in ((controller, frames), (expected, 3)):
        flown.press("d")
        for _ in range(steps):
            flown.step(1.0 / steps)
        flown.let_go("d")
        for _ in range(steps):
            flown.step(0.2 / steps)
    assert np.allclose(controller.eye, expected.eye, atol=1e-9)


def test_reaches_its_speed_and_comes_to_rest(controller):
    controller.press("d")
    controller.step(10.0)
    before = controller.eye.copy()
    controller.step(1.0)
    assert np.linalg.norm(controller.eye - before) == pytest.approx(controller.speed_m_s)
    controller.press("shift")
    controller.step(10.0)
    before = controller.eye.copy()
    controller.step(1.0)
    assert np.linalg.norm(controller.eye - before) == pytest.approx(FAST * controller.speed_m_s)
    controller.let_go_all()
    for _ in range(100):
        controller.step(0.02)
    assert not controller.moving


def test_wheel_changes_speed_within_limits(controller):
    before = controller.speed_m_s
    controller.wheel(2)
    assert controller.speed_m_s == pytest.approx(before * WHEEL**2)
    controller.wheel(-1000)
    assert 0 < controller.speed_m_s < before
    controller.wheel(1000)
    assert math.isfinite(controller.speed_m_s)


def test_look_turns_and_stops_short_of_the_vertical(controller):
    controller.look(100, 0)
    assert controller.azimuth_deg == pytest.approx(10)
    for _ in range(3):
        controller.look(0, 5000)
        assert controller.camera.forward[2] > -1
    controller.look(0, -50000)
    assert np.isfinite(controller.camera.axes).all()


def test_orbit_keeps_what_was_grabbed_in_its_place(controller):
    x, y = 0.2, -0.1
    controller.grab(x, y)
    pivot = controller._pivot
    assert pivot[2] == pytest.approx(ground_m(controller.heightmap, pivot[:2])[0], abs=0.01)
    distance = np.linalg.norm(pivot - controller.eye)
    controller.orbit(70, 15)
    right, up, forward = controller.axes @ (pivot - controller.eye)
    assert (right / forward, up / forward) == pytest.approx((x, y))
    assert np.linalg.norm(pivot - controller.eye) == pytest.approx(distance)
    assert not np.allclose(controller.eye, controller.start.eye)


def test_grabbing_the_sky_takes_the_middle_or_far_away(controller):
    controller.grab(0, 0)
    middle = controller._pivot
    controller.grab(0, 5)
    assert np.allclose(controller._pivot, middle)
    controller.look(0, -1000)  # nothing but sky
    controller.grab(0, 0)
    assert np.isfinite(controller._pivot).all()


def test_stays_above_ground_unless_told_otherwise(controller):
    controller.eye = np.array([640.0, 640.0, 150.0])
    controller.speed_m_s = 1000.0
    controller.press("q")
    controller.step(1.0)
    assert controller.height_above_ground_m == pytest.approx(CLEARANCE * 10)
    controller.above_ground = False
    controller.step(1.0)
    assert controller.height_above_ground_m < -500


def test_no_ground_outside_the_map_nor_over_voids():
    heights = np.full((5, 5), 10.0)
    heights[2, 2] = np.nan
    controller = Controller(Heightmap(heights, 1.0), Camera((2, 2, 3), (2, 4, 3)))
    assert math.isnan(controller.height_above_ground_m)
    controller.step(0.1)
    assert controller.eye[2] == 3
    controller.eye = np.array([-50.0, 0, -7])
    controller.step(0.1)
    assert controller.eye[2] == -7


def test_hit_ground_finds_the_first_hill():
    heightmap = hills()
    eye = np.array([640.0, -200.0, 400.0])
    hit = hit_ground(heightmap, eye, np.array([0.0, 2.0, -0.8]))
    assert hit[2] == pytest.approx(ground_m(heightmap, hit[:2])[0], abs=1e-3)
    assert hit_ground(heightmap, eye, np.array([0.0, 0.0, 1.0])) is None


def test_home_comes_back(controller):
    controller.look(300, 100)
    controller.press("w")
    controller.step(1.0)
    controller.let_go_all()
    controller.home()
    assert controller.camera.eye == controller.start.eye and not controller.moving


# --- Settings and words -----------------------------------------------------------------------------------------------


def test_keys_change_the_drawing():
    settings = Settings()
    for number, style in enumerate(STYLES, 1):
        settings.press(str(number))
        assert settings.drawing.style == style
    settings.press("tab")
    assert settings.drawing.style == STYLES[0]
    settings.press("+")
    assert settings.drawing.max_error_px == pytest.approx(STEP)
    settings.press("-")
    assert settings.drawing.max_error_px == pytest.approx(1)
    for _ in range(100):
        settings.press("-")
    assert settings.drawing.max_error_px > 0
    settings.press("m")
    settings.press("f")
    assert (settings.drawing.metric, settings.drawing.method) == ("rms", "full")
    before = replace(settings)
    settings.press("x")
    assert settings == before


def test_every_key_that_does_something_is_told():
    told = " ".join(keys for keys, _ in KEYS).lower().split()
    assert set("wasdeqcgmfpih+-") | {"home", "tab", "esc", "f1", "shift", "wheel"} <= set(told)


def test_typeface_has_all_words_that_are_shown():
    shown = "".join(keys + meaning for keys, meaning in KEYS) + "≤ × … · ° –" + "".join(map(chr, range(32, 127)))
    assert [c for c in shown if c not in font.INDEX] == []
    assert font.indices("\u4e00") == font.indices("\ufffd")


@pytest.mark.parametrize("scale", [1, 2, 3])
def test_glyphs_keep_to_their_cells_and_differ(scale):
    atlas = font.atlas(scale)
    width = font.WIDTH * scale
    cells = [atlas[:, at : at + width] for at in range(0, atlas.shape[1], width)]
    assert len(cells) == len(font.GLYPHS) and atlas.shape[0] == font.HEIGHT * scale
    assert len({cell.tobytes() for cell in cells}) == len(cells)
    assert all(cell.max() > 200 for cell, glyph in zip(cells, font.GLYPHS, strict=True) if glyph != " ")
    assert all(max(cell[0].max(), cell[:, 0].max()) < 40 for cell in cells)  # a breath of the pen at most


def test_metres_read_well():
    texts = [metres(value) for value in (0.853, 12.44, 870.4, 5234, 52345)]
    assert texts == ["0.853 m", "12.4 m", "870 m", "5,234 m", "52.3 km"]


def test_figures_say_what_is_unknown():
    stats = {"ms": {"lod": 1.0, "draw": 2.0}, "width": 640, "height": 400, "triangles": 12345, "patches": 678}
    stats["certified_max_error_px"] = 0.98766
    figures = Figures("hills", (129, 129), None, stats)
    lines = ["".join(run.text for run in line).rstrip() for line in hud.figures_panel(figures, Settings()).lines]
    assert "promised   ≤ 0.9877 px" in lines and "measured   …" in lines and "triangles  12,345" in lines
    assert "frame      at rest  3 ms" in lines and "height     –" in lines
    figures.measured_px = {"max": 0.5, "rms": 0.25}
    lines = ["".join(run.text for run in line).rstrip() for line in hud.figures_panel(figures, Settings()).lines]
    assert "measured   0.500 px" in lines


def test_overlay_is_crisp_and_stays_in_its_panel(ctx):
    size = (400, 120)
    target = ctx.framebuffer([ctx.texture(size, 4)])
    target.clear(0.5, 0.5, 0.5, 1.0)
    overlay = Overlay(ctx)
    overlay.draw(target, size, [Panel([[Text("promised ≤ 0.98 px")]])])
    pixels = np.frombuffer(target.read(), np.uint8).reshape(size[1], size[0], 3)[::-1].astype(int)
    touched = (pixels != 128).any(-1)
    rows, cols = np.nonzero(touched)
    assert (cols.min(), rows.min()) == (12, 12) and cols.max() < 12 + 24 + 18 * 8 and rows.max() < 12 + 24 + 17
    expected = np.hstack([font.atlas(1)[:, g * 8 : g * 8 + 8] for g in font.indices("promised ≤ 0.98 px")])
    ink = pixels[24:41, 24 : 24 + 144].max(-1)
    assert np.corrcoef(ink.ravel(), expected.ravel())[0, 1] > 0.999  # texel for pixel
    ctx.detect_framebuffer(0).use()
    overlay.release()
    target.release()


# --- Flight: frames without a window ----------------------------------------------------------------------------------


@pytest.fixture
def flight(ctx):
    heightmap = hills()
    with Renderer(heightmap, (320, 200), ctx=ctx) as renderer:
        target = ctx.framebuffer([ctx.texture((320, 200), 4)])
        overlay = Overlay(ctx)
        flight = Flight(renderer, overlay, target, Camera.default(heightmap), Settings())
        yield flight
        ctx.detect_framebuffer(0).use()  # moderngl binds again what was in use, even when it is gone
        overlay.release()
        target.release()


def settle(flight, now_s=0.0):
    for _ in range(100):
        if not flight.frame(now_s) and not flight.busy:
            return
        now_s += 1.0
    raise AssertionError("the flight does not come to rest")


def seen(flight):
    width, height = flight.size
    return np.frombuffer(flight.target.read(), np.uint8).reshape(height, width, 3)[::-1].astype(int)


def test_at_rest_it_measures_and_draws_no_more(flight):
    settle(flight)
    measured = dict(flight.figures.measured_px)
    stats = flight.renderer.measure()
    assert measured == pytest.approx({"max": stats["max_error_px"], "rms": stats["rms_error_px"]}, rel=1e-9)
    assert measured["max"] <= stats["certified_max_error_px"] <= 1.0
    assert not flight.frame(1000.0)


def test_motion_is_drawn_and_ends_in_a_full_frame(flight):
    settle(flight)
    before = seen(flight)
    flight._full_ms = 1000.0  # as on a slow machine
    for key in ("w", "shift"):
        flight.controller.press(key)
    assert flight.frame(100.0) and flight.figures.shrunk == 4 and flight.renderer.size == (80, 50)
    assert flight.frame(100.1) and flight.figures.fps
    assert flight.figures.measured_px is None
    flight.controller.let_go("w")
    settle(flight, 101.0)
    assert flight.renderer.size == (320, 200) and flight.figures.measured_px and flight.figures.fps is None
    assert changed(seen(flight), before) > 0.02


def test_words_stand_over_the_picture_and_go(flight):
    settle(flight)
    with_figures = seen(flight)
    flight.press("i", 100.0)
    flight.frame(100.0)
    bare = seen(flight)
    flight.press("h", 100.0)
    flight.frame(100.0)
    with_keys = seen(flight)
    assert (with_figures != bare).any(-1)[:150, :150].mean() > 0.5
    assert (with_keys != bare).any(-1).mean() > 0.2


def test_messages_come_and_go(flight):
    settle(flight)
    flight.say("hello", 100.0)
    assert flight.frame(100.0) and len(flight.panels()) == 2
    assert flight.frame(200.0) and len(flight.panels()) == 1


def test_a_minimised_window_draws_nothing_and_comes_back(flight):
    settle(flight)
    flight.resize((0, 0))
    assert not flight.frame(100.0)
    flight.resize((320, 200))
    assert flight.frame(100.0)


def test_the_picture_is_saved_without_words_beside_earlier_ones(flight, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for _ in range(2):
        flight.press("p", 0.0)
        flight.frame(0.0)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["hills-001.png", "hills-002.png"]
    assert (tmp_path / "hills-001.png").read_bytes() == (tmp_path / "hills-002.png").read_bytes()
    assert free_name("x/hills.tif").name == "hills-003.png"
    assert "hills-002.png" in flight._message


def test_a_picture_that_cannot_be_saved_is_told(flight, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.rmtree(tmp_path)
    flight.press("p", 0.0)
    flight.frame(0.0)
    assert flight._message and "saved" not in flight._message


def changed(picture, before):
    """Share of pixels that differ visibly."""
    return (np.abs(picture - before).max(-1) > 4).mean()


# --- A real window ----------------------------------------------------------------------------------------------------

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
sys.exit(viewer.run(Heightmap(np.load(sys.argv[1]), 10.0, "hills"), size=(640, 480)))
"""


class Screen:
    """An X server without a screen, whose pixels lie in a file."""

    def __init__(self, folder):
        self.folder = folder
        read, write = os.pipe()
        options = ["-displayfd", str(write), "-screen", "0", "800x600x24", "-fbdir", str(folder), "-nolisten", "tcp"]
        self.server = subprocess.Popen(["Xvfb", *options], pass_fds=[write], stderr=subprocess.DEVNULL)
        os.close(write)
        with os.fdopen(read) as pipe:
            self.environment = os.environ | {"DISPLAY": f":{pipe.readline().strip()}"}

    def pixels(self):
        """(height, width, 3) of the screen, from its XWD file."""
        data = (self.folder / "Xvfb_screen0").read_bytes()
        header = np.frombuffer(data, ">u4", 25)
        width, height, stride, first = header[4], header[5], header[12], header[0] + 12 * header[19]
        rows = np.frombuffer(data, np.uint8, height * stride, first).reshape(height, stride)
        return rows[:, : 4 * width].reshape(height, width, 4)[..., 2::-1].astype(int)

    def do(self, *words):
        subprocess.run(["xdotool", *map(str, words)], env=self.environment, check=True, stdout=subprocess.DEVNULL)

    def start(self, *command, cwd):
        return subprocess.Popen(
            [sys.executable, *map(str, command)],
            cwd=cwd,
            env=self.environment,
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )

    def wait(self, condition, what, seconds=30):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if condition():
                return
            time.sleep(0.05)
        raise AssertionError(f"waited {seconds} s for {what}")


@pytest.fixture(scope="module")
def screen(tmp_path_factory):
    for program in ("Xvfb", "xdotool"):
        if not shutil.which(program):
            pytest.skip(f"no {program} here; apt install {program.lower()}")
    screen = Screen(tmp_path_factory.mktemp("screen"))
    yield screen
    screen.server.terminate()
    screen.server.wait()


@contextlib.contextmanager
def running(screen, *command, cwd):
    process = screen.start(*command, cwd=cwd)
    try:
        yield process
    finally:
        if process.poll() is None:
            process.kill()
            process.communicate()


def has_figures(screen):
    """Whether the panel at the top left is there, with its title in its colour."""
    title = screen.pixels()[24:41, 24:104]
    return ((title[..., 0] > 180) & (title[..., 2] < 150)).sum() > 30


def test_window(screen, tmp_path):
    np.save(tmp_path / "hills.npy", hills().heights)
    with running(screen, "-c", _RUN, "hills.npy", cwd=tmp_path) as process:
        screen.wait(lambda: has_figures(screen), "the first picture")
        screen.do("search", "--sync", "--name", "hills", "windowfocus")
        pictures = [tmp_path / f"hills-{number:03d}.png" for number in (1, 2, 3, 4, 5)]

        def picture(number):
            screen.do("key", "p")
            screen.wait(pictures[number].exists, pictures[number].name)
            return load(pictures[number])

        first = picture(0)
        assert first.shape[:2] == (480, 640) and first.std() > 5

        screen.do("click", "--repeat", 5, 4, "keydown", "w", "sleep", "0.5", "keyup", "w")
        flown = picture(1)
        assert changed(flown, first) > 0.02

        screen.do("mousemove", 320, 300, "mousedown", 1, "mousemove", 380, 310, "mouseup", 1)
        screen.do("mousemove", 320, 240, "mousedown", 3, "mousemove", 300, 240, "mouseup", 3, "click", 5)
        screen.do("key", "5", "key", "plus", "key", "m", "key", "Tab", "key", "Tab")
        turned = picture(2)
        assert changed(turned, flown) > 0.2

        before = screen.pixels()
        screen.do("key", "h")
        screen.wait(lambda: (screen.pixels() != before).any(-1)[120:360, 250:390].mean() > 0.5, "the keys")
        screen.do("key", "h", "key", "Home", "key", "1", "key", "minus", "key", "m")
        assert np.array_equal(picture(3), first)

        screen.do("search", "--name", "hills", "windowsize", 500, 300)
        screen.wait(lambda: screen.pixels()[310:, 510:].max() == 0, "the smaller window")
        assert picture(4).shape[:2] == (300, 500)
        assert has_figures(screen)

        screen.do("key", "Escape")
        output, errors = process.communicate(timeout=20)
    assert (process.returncode, output.strip(), errors) == (0, "GL_NO_ERROR", "")


def test_view_command(screen, tmp_path):
    with running(screen, "-m", "terrain_gl", "view", "--size", "320x240", cwd=tmp_path) as process:
        screen.wait(lambda: has_figures(screen), "the first picture")
        screen.do("search", "--sync", "--name", "terrain-gl", "windowfocus", "key", "Escape")
        output, errors = process.communicate(timeout=20)
    assert (process.returncode, output, errors) == (0, "", "")


def test_without_a_display():
    environment = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}
    command = [sys.executable, "-m", "terrain_gl", "view", "canyon"]
    result = subprocess.run(command, env=environment, text=True, capture_output=True)
    assert (result.returncode, result.stdout, len(result.stderr.splitlines())) == (1, "", 1)
    assert "display" in result.stderr and "terrain-gl shot" in result.stderr


def load(path):
    return read_image(path)[..., :3].astype(int)
