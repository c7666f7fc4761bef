"""The viewer: what keys and mouse do to the camera, the words on the picture, and a real window under Xvfb."""

import contextlib
import json
import math
import os
import re
import shlex
import shutil
import subprocess
import sys
import time
from dataclasses import replace
from importlib.resources import files

import numpy as np
import pytest

from terrain_gl.brush import TOOLS, dab, places
from terrain_gl.camera import Camera
from terrain_gl.cli.line import command_line
from terrain_gl.drawing import METHODS, Drawing
from terrain_gl.error import ErrorTables
from terrain_gl.exceptions import TerrainError
from terrain_gl.explain import Choice, Explanation
from terrain_gl.export import FORMATS
from terrain_gl.film.path import CameraPath
from terrain_gl.heightmap import Heightmap
from terrain_gl.image import read_image, write_image
from terrain_gl.lod import METRICS
from terrain_gl.renderer import Renderer
from terrain_gl.shade import STYLES
from terrain_gl.terrain import Terrain
from terrain_gl.viewer import font, hud, legend, lesson
from terrain_gl.viewer.commands import BY_KEY, GROUPS, shown_lines
from terrain_gl.viewer.controller import (
    CLEARANCE,
    FAST,
    MOVE_KEYS,
    TRAVEL_S,
    WHEEL,
    Controller,
    Pose,
    ground_m,
    hit_ground,
)
from terrain_gl.viewer.flight import Flight
from terrain_gl.viewer.gui import Gui
from terrain_gl.viewer.hud import Figures, metres
from terrain_gl.viewer.keeping import SIZES, free_name
from terrain_gl.viewer.loading import COARSE, Opened, coarse, file_opener
from terrain_gl.viewer.memory import Memory, state_path
from terrain_gl.viewer.overlay import Overlay, Panel, Text
from terrain_gl.viewer.pace import Pace
from terrain_gl.viewer.settings import STEP, Settings


def hills(posts=129, spacing_m=10.0):
    t = np.linspace(0, 3 * math.pi, posts)
    return Heightmap(60 * np.sin(t)[:, None] * np.cos(0.7 * t)[None, :] + 100, spacing_m, "hills")


@pytest.fixture
def controller():
    return Controller(hills(), Camera((640, -200, 400), (640, 640, 100)))


# --- Controller -------------------------------------------------------------------------------------------------------


def test_starts_with_the_camera_given(controller):
    assert controller.camera.eye == (640, -200, 400)
    assert controller.camera == controller.start != Pose.of(controller.start).camera  # to the last digit
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


def test_arrows_turn_the_head(controller):
    before = controller.pose
    controller.press("right")
    assert controller.moving
    controller.step(0.5)
    assert controller.azimuth_deg == pytest.approx(before.azimuth_deg + 20) and controller.pose.eye == before.eye
    controller.press("left")
    assert not controller.moving


def test_bookmarks_are_travelled_to_smoothly(controller):
    assert not controller.go_to(3)
    there = Pose((100.0, 700.0, 500.0), 350.0, -30.0, 40.0)
    controller.bookmarks[3] = there
    start = controller.pose
    assert controller.go_to(3) and controller.moving
    controller.step(TRAVEL_S / 2)
    half = controller.pose
    assert np.allclose(half.eye, (np.array(start.eye) + there.eye) / 2)
    assert half.azimuth_deg == pytest.approx(355.0)  # from 0 to 350 the short way
    controller.step(TRAVEL_S)
    assert controller.pose == there and not controller.moving
    controller.set_bookmark(4)
    assert controller.bookmarks[4] == there


def test_a_key_breaks_off_the_travel(controller):
    controller.bookmarks[1] = Pose((100.0, 700.0, 500.0), 350.0, -30.0, 40.0)
    controller.go_to(1)
    controller.press("d")
    controller.let_go("d")
    assert not controller.moving


def test_orbiting_by_keys_keeps_the_distance_and_the_middle(controller):
    controller.change_mode("orbit")
    pivot = controller._pivot
    distance = np.linalg.norm(pivot - controller.eye)
    controller.press("d")
    for _ in range(30):
        controller.step(0.1)
    assert np.linalg.norm(pivot - controller.eye) == pytest.approx(distance)
    assert np.allclose(np.cross(pivot - controller.eye, controller.axes[2]), 0, atol=1e-6)
    controller.let_go("d")
    controller.press("w")
    controller.step(2.0)
    assert np.linalg.norm(pivot - controller.eye) < 0.5 * distance


def test_a_walker_stays_at_eye_height_and_on_the_map(controller):
    controller.change_mode("walk")
    assert controller.pose.eye == controller.start.eye  # there is no ground below
    controller.eye = np.array([640.0, 640.0, 500.0])
    controller.change_mode("walk")
    heights = []
    controller.press("w")
    for _ in range(400):
        controller.step(0.25)
        heights.append(controller.height_above_ground_m)
    assert np.allclose(heights, 1.7, atol=1e-4)
    assert controller.eye[1] > 1000 and controller.eye[1] <= 1280  # came to the map's edge and stopped there
    assert controller.near_m < 1.7 and Controller(controller.heightmap, controller.start).near_m is None


def test_zoom_changes_the_field_of_view_within_limits(controller):
    controller.zoom(3)
    assert controller.camera.fov_deg < 50
    controller.zoom(-1000)
    controller.zoom(1000)
    assert controller.camera.fov_deg == 1


# --- What is remembered -----------------------------------------------------------------------------------------------


def test_memory_comes_back(tmp_path):
    pose = Pose((1.0, 2.0, 3.0), 4.0, 5.0, 60.0)
    memory = Memory(tmp_path / "deep" / "view.json")
    memory.window, memory.drawing, memory.panels = (800, 600), Drawing(2.5, style="lod", sun=(1, 2)), {"figures": False}
    memory.note_map("hills", pose, {3: pose})
    memory.save()
    again = Memory(tmp_path / "deep" / "view.json")
    assert memory.complaint == again.complaint == ""
    assert again.window == (800, 600) and again.panels == {"figures": False}
    assert again.drawing == {"max_error_px": 2.5, "metric": "max", "method": "sat", "style": "lod"}
    assert again.bookmarks("hills") == {3: pose} and again.last_pose("hills") == pose
    assert again.bookmarks("other") == {} and again.last_pose("other") is None


@pytest.mark.parametrize(
    "text",
    ["", "{", "[]", "null", "\0\xff", '{"window": [1, "x"], "drawing": {"style": 5}, "panels": 3, "maps": []}']
    + ['{"window": [1e999, 0], "drawing": {"max_error_px": "much"}, "maps": {"hills": {"pose": [1, 2]}}}']
    + ['{"maps": {"hills": {"bookmarks": 7, "pose": [1e99, 0, 0, 0, 0, 0]}}}', '{"drawing": {"max_error_px": -1}}']
    + ['{"maps": {"hills": {"bookmarks": {"1": [NaN]}}}}'],
)
def test_a_damaged_memory_is_ignored(tmp_path, text):
    path = tmp_path / "view.json"
    path.write_text(text, "latin-1")
    memory = Memory(path)
    assert (memory.window, memory.drawing, memory.panels) == (None, {}, {})
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


def test_memory_stands_where_the_desktop_wants_it(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    assert state_path() == tmp_path / "terrain-gl" / "view.json"
    monkeypatch.delenv("XDG_STATE_HOME")
    monkeypatch.setenv("HOME", "/home/someone")
    assert str(state_path()) == "/home/someone/.local/state/terrain-gl/view.json"


# --- Settings and words -----------------------------------------------------------------------------------------------


def test_settings_change_the_drawing():
    settings = Settings()
    assert [settings.cycle("style") for _ in STYLES] == [*STYLES[1:], STYLES[0]]
    assert settings.cycle("style", -1) == STYLES[-1]
    settings.loosen(1)
    assert settings.drawing.max_error_px == pytest.approx(STEP)
    settings.loosen(-1)
    assert settings.drawing.max_error_px == pytest.approx(1)
    settings.loosen(-1000)
    assert settings.drawing.max_error_px > 0
    assert settings.cycle("metric") == "rms" == settings.drawing.metric
    settings.sides.append(settings.drawing)
    settings.active = 1
    settings.draw(metric="max")
    assert [side.metric for side in settings.sides] == ["rms", "max"]
    settings.draw_both(sun=(1.0, 2.0))
    assert [side.sun for side in settings.sides] == [(1.0, 2.0)] * 2


def test_settings_with_a_budget_change_that():
    settings = Settings([Drawing(triangles=1000)])
    settings.loosen(2)
    assert (settings.drawing.triangles, settings.drawing.max_error_px) == (500, None)
    settings.loosen(-2)
    assert settings.drawing.triangles == 1000
    for _ in METHODS:
        assert settings.cycle("method") != "full"  # which draws every post
    settings.loosen(1000)
    assert settings.drawing.triangles >= 2


def test_every_command_has_a_key_of_its_own_and_a_line_of_help():
    keys = [key for commands in GROUPS.values() for command in commands for key in command.keys]
    assert len(keys) == len(set(keys)) and not set(keys) & set(MOVE_KEYS)
    acting = [command for commands in GROUPS.values() for command in commands if command.act]
    assert all(command.keys for command in acting)
    told = " ".join(shown for _, shown, _ in shown_lines()).lower()
    plain = {key for key in keys if "+" not in key[1:] and key not in "=23456789"}
    assert [key for key in plain if {"escape": "esc"}.get(key, key) not in told] == []
    assert all(1 < len(meaning) <= 60 for _, _, meaning in shown_lines())


@pytest.mark.parametrize(("size", "pages"), [((1280, 800), 1), ((640, 360), 4), ((320, 240), None)])
def test_all_keys_are_shown_in_a_window_of_any_size(ctx, size, pages):
    overlay = Overlay(ctx)
    columns, rows = overlay.room(size)
    panels = hud.keys_pages(columns, rows)
    assert len(panels) == (pages or len(panels)) and all(len(panel.lines) <= rows for panel in panels)
    lines = ["".join(run.text for run in line).rstrip() for panel in panels for line in panel.lines]
    assert max(map(len, lines)) <= columns
    words = " ".join(lines).split()
    assert all(set(f"{keys} {meaning}".split()) <= set(words) for _, keys, meaning in shown_lines())
    overlay.release()


def test_help_turns_its_pages_and_goes(flight):
    pages = len(hud.keys_pages(*flight.overlay.room(flight.size)))
    shown = []
    for _ in range(pages):
        flight.press("h")
        shown.append(flight.panels()[0])
    assert pages > 1 and len(set(map(str, shown))) == pages
    flight.press("h")
    assert flight.settings.keys == 0


def test_text_alone_explains_too(flight):
    """Without panels a click, a split and the table's box are told all the same."""
    settle(flight)
    flight.insight.explain(160, 150)
    told = "".join(run.text for panel in flight.panels() for line in panel.lines for run in line)
    assert lesson.title(flight.insight.explanation) in told and "drawn" in told
    flight.press("t")
    settle(flight)
    told = [run.text for panel in flight.panels() for line in panel.lines for run in line]
    assert [lesson.side_line(*side) for side in zip(flight.settings.sides, flight.painter.side_stats, strict=True)] == [
        line for line in told if "triangles," in line
    ]


def test_typeface_has_all_words_that_are_shown():
    shown = "≤ × … · ° – ■" + "".join(map(chr, range(32, 127)))
    shown += "".join(group + keys + meaning for group, keys, meaning in shown_lines())
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
    stats["metric"] = "max"
    stats |= {"certified_max_error_px": 0.98766, "ms_clock": "gpu", "gl_renderer": "llvmpipe (LLVM 15.0.6, 256 bits)"}
    figures = Figures("hills", (129, 129), None, stats)
    lines = ["".join(run.text for run in line).rstrip() for line in hud.figures_panel(figures, Settings()).lines]
    assert "promised   ≤ 0.9877 px" in lines and "measured   …" in lines and "triangles  12,345" in lines
    clocks = [stats | {"gl_renderer": "NVIDIA H200/PCIe"}, stats | {"ms_clock": "cpu"}]
    assert [hud.clock(each)[0] for each in (stats, *clocks)] == ["llvmpipe", "GPU", "CPU"]
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
def empty(ctx):
    """A flight that has no map yet."""
    target = ctx.framebuffer([ctx.texture((320, 200), 4)])
    overlay = Overlay(ctx)
    flight = Flight(overlay, target, (320, 200), Settings(), pace=swift())
    yield flight
    flight.close()
    ctx.detect_framebuffer(0).use()  # moderngl binds again what was in use, even when it is gone
    overlay.release()
    target.release()


@pytest.fixture
def flight(empty):
    heightmap = hills()
    empty.land.show(Renderer(heightmap, (320, 200), ctx=empty.ctx), Opened(heightmap, Camera.default(heightmap)))
    return empty


class Ticking:
    """A clock by which every piece of work takes a second, however fast the machine is."""

    def __init__(self):
        self.now_s = 0.0

    def __call__(self):
        self.now_s += 1.0
        return self.now_s


def swift():
    """The pace of a machine that is done with everything at once."""
    return Pace(Ticking(), portion_s=math.inf, smooth_ms=math.inf, coarse_ms=math.inf)


def slow():
    """The pace of one that does a portion of work a frame, and draws motion in a quarter of the size."""
    return Pace(Ticking(), smooth_ms=-1.0, coarse_ms=-1.0)


def take_pace(flight, pace):
    """Go on at another pace."""
    for name, value in vars(pace).items():
        setattr(flight.pace, name, value)


def wait_for_threads(flight):
    """Until all that is read or written is there; what is read is then on its way to the screen."""
    if flight.land.loading:
        flight.land.loading.join()
    for thread in (flight.sculpting, flight.dressing, flight.keeping, flight.keeping.filming):
        thread.join()


def later(flight, seconds=1.0):
    """The frame after some time; whether there is anything new to see."""
    return flight.frame(flight.now_s + seconds)


def settle(flight):
    """Frames until nothing happens any more, and the last picture has been measured."""
    flight.refresh()
    for _ in range(20_000):
        wait_for_threads(flight)
        if not (later(flight) or flight.busy or flight.painter.waits_for_rest) and flight.settled:
            return
    raise AssertionError("the flight does not come to rest")


def seen(flight):
    width, height = flight.size
    pixels = flight.target.read((0, 0, width, height))
    return np.frombuffer(pixels, np.uint8).reshape(height, width, 3)[::-1].astype(int)


def drawn_at_once(flight):
    """What the renderer makes of the flight's view, without panels."""
    flight.renderer.draw(flight.controller.camera, **vars(flight.settings.drawing))
    flight.painter.canvas.compose(flight.renderer, flight.size)
    flight.painter.canvas.show(flight.target)
    return seen(flight)


def test_the_first_picture_comes_quickly_then_the_full_one(empty):
    take_pace(empty, slow())
    heightmap = hills()
    empty.land.show(Renderer(heightmap, (320, 200), ctx=empty.ctx), Opened(heightmap, Camera.default(heightmap)))
    assert later(empty) and empty.figures.shrunk == 4 and empty.figures.stats["width"] == 80
    later(empty)
    shares = []
    while empty.painter.dawn.share is not None:  # until there is light
        shares.append(empty.painter.dawn.share)
        assert empty.busy and empty.figures.shrunk == 4
        later(empty, 0.01)
    assert len(shares) > 5 and shares == sorted(shares)
    frames = 0
    while empty.figures.shrunk == 4:  # the full picture comes in portions, between which events are looked at
        assert empty.busy and empty.painter.has_picture
        later(empty, 0.3)
        frames += 1
    assert frames > 5 and empty.figures.stats["width"] == 320
    settle(empty)


def test_a_full_picture_in_portions_is_the_same(flight):
    flight.settings.figures = False
    take_pace(flight, slow())
    settle(flight)
    drawn, pose = seen(flight), flight.controller.pose
    flight.painter.forget()
    assert not later(flight) and flight.busy  # there is nothing new to see yet
    flight.controller.look(30, 0)
    assert later(flight)  # a motion comes between
    flight.controller.pose = pose
    settle(flight)
    assert np.array_equal(seen(flight), drawn)
    assert np.array_equal(drawn_at_once(flight), drawn)


def test_a_large_map_is_seen_coarsely_while_its_tables_are_built(empty):
    n = 4 * COARSE + 1
    heights = np.add.outer(np.sin(np.arange(n) / 40.0), np.cos(np.arange(n - 500) / 60.0)) * 200
    heightmap = Heightmap(heights, (10.0, 12.0), "large")
    few = coarse(heightmap)
    assert max(few.heights.shape) == COARSE and np.allclose(few.extent_m, heightmap.extent_m)
    assert few.heights[-1, -1] == heightmap.heights[-1, -1] and coarse(hills()) is None
    take_pace(empty, slow())
    empty.land.load("large", lambda progress: Opened(heightmap, Camera.default(heightmap), key="large"))
    empty.land.loading.join()
    pictures = []
    while empty.land.loading:
        later(empty)
        pictures.append(empty.has_map and empty.renderer.heightmap)
    first = next(picture for picture in pictures if picture)
    assert first.rows == COARSE and pictures.count(first) > 3
    assert empty.renderer.heightmap is heightmap and empty.controller.heightmap is heightmap
    empty.controller.look(50, 0)
    take_pace(empty, swift())
    settle(empty)
    assert empty.figures.measured_px["max"] <= 1


def test_a_file_is_loaded_beside_the_map_that_is_seen(flight, tmp_path):
    settle(flight)
    before = flight.renderer
    np.save(tmp_path / "slope.npy", np.add.outer(np.arange(40.0), np.arange(30.0)))
    take_pace(flight, slow())
    flight.land.load("slope.npy", file_opener(str(tmp_path / "slope.npy")))
    later(flight)
    assert flight.renderer is before and "slope.npy" in flight.land.loading.text
    assert any("slope.npy" in run.text for panel in flight.panels() for line in panel.lines for run in line)
    settle(flight)
    assert flight.renderer.heightmap.cols == 30 and flight.figures.posts == (30, 40)


@pytest.mark.parametrize("content", [b"", b"no map", b"\x89PNG\r\n\x1a\n damaged"])
def test_a_broken_file_is_told_in_a_line_and_the_map_stays(flight, tmp_path, content):
    settle(flight)
    before = flight.renderer
    (tmp_path / "broken.png").write_bytes(content)
    flight.land.load("broken.png", file_opener(str(tmp_path / "broken.png")))
    settle(flight)
    assert flight.renderer is before and flight.land.loading is None
    flight.land.load("gone.tif", file_opener(str(tmp_path / "gone.tif")))
    flight.land.loading.join()
    later(flight)
    assert not flight.land.loading and "gone.tif" in flight.message and "\n" not in flight.message


def test_loading_is_cancelled(flight):
    settle(flight)
    before, heightmap = flight.renderer, Heightmap(np.zeros((800, 900)), 1.0)
    told = []

    def slowly(progress):
        for part in range(10000):
            told.append(part)
            progress(part / 10000)
            time.sleep(0.01)

    flight.land.load("endless", slowly)
    thread = flight.land.loading._thread
    flight.press("escape")
    assert not flight.land.loading and not flight.done
    thread.join(5)
    assert not thread.is_alive() and len(told) < 1000
    take_pace(flight, slow())
    flight.land.load("zeros", lambda progress: Opened(heightmap, Camera.default(heightmap)))
    flight.land.loading.join()
    while flight.land.loading._building is None:
        later(flight)
    flight.press("escape")
    settle(flight)
    assert flight.renderer is before


def test_a_map_that_was_first_and_fails_ends_the_flight(empty):
    def failing(progress):
        raise TerrainError("broken.tif: is broken")

    empty.land.load("broken.tif", failing)
    empty.land.loading.join()
    with pytest.raises(TerrainError, match="is broken"):
        later(empty)


def test_a_flight_is_closed_while_a_map_loads(ctx):
    heightmap = Heightmap(np.zeros((1000, 900)), 1.0)
    overlay, target = Overlay(ctx), ctx.framebuffer([ctx.texture((32, 20), 4)])
    for frames in (1, 3, 6):
        flight = Flight(overlay, target, (32, 20), Settings(), pace=slow())
        flight.land.load("zeros", lambda progress: Opened(heightmap, Camera.default(heightmap)))
        flight.land.loading.join()
        for _ in range(frames):
            later(flight)
        assert flight.land.loading
        flight.close()
    ctx.detect_framebuffer(0).use()
    overlay.release()
    target.release()


def test_nobody_does_anything_in_a_window_of_no_size(flight, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    settle(flight)
    size, before = flight.size, flight.renderer.heightmap.heights.copy()
    flight.mouse.press("left", 160, 150)
    flight.resize((0, 0))
    flight.mouse.let_go("left", 160, 150)
    flight.mouse.press("left", 160, 150)
    for key in BY_KEY:
        if key != "escape":
            flight.press(key)
            later(flight)
    flight.mouse.let_go("left", 160, 150)
    flight.resize(size)
    settle(flight)
    assert np.array_equal(flight.renderer.heightmap.heights, before) and flight.figures.measured_px
    assert not list(tmp_path.iterdir())
    flight.press("b")
    settle(flight)
    flight.mouse.press("left", 160, 150)
    later(flight)
    flight.resize((0, 0))
    flight.mouse.let_go("left", 0, 0)
    flight.resize(size)
    settle(flight)
    assert flight.sculpting.editing.strokes == (1, 0) and flight.renderer._unsettled is None
    flight.resize((0, 0))
    for _ in range(3):  # the brush; what is sculpted is not saved
        assert not flight.done
        flight.press("escape")
    assert flight.done


def test_keys_do_what_they_say(flight, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    flight.resize((80, 50))  # there are many of them
    settle(flight)
    for key in BY_KEY:
        if key not in ("escape", "p", "r", "ctrl+s"):
            flight.press(key)
            settle(flight)
    assert set(flight.controller.bookmarks) == set(range(1, 10))
    flight.press("nonsense")
    flight.settings.keys = 1
    flight.press("escape")
    assert not flight.settings.keys and not flight.done
    for _ in range(3):  # the brush, the glass, the split: each is put away
        assert not flight.done
        flight.press("escape")
    assert not (flight.sculpting.brushing or flight.settings.lens)
    for _ in range(3):
        flight.press("escape")
    assert flight.done and not flight.settings.split


def test_what_was_seen_is_seen_again(ctx, tmp_path):
    heightmap = hills()
    overlay, target = Overlay(ctx), ctx.framebuffer([ctx.texture((32, 20), 4)])
    opened = Opened(heightmap, Camera.default(heightmap), key="hills")
    poses = []
    for _ in range(2):
        flight = Flight(overlay, target, (32, 20), Settings(), Memory(tmp_path / "view.json"))
        flight.land.show(Renderer(heightmap, (32, 20), ctx=ctx), opened)
        poses.append(flight.controller.pose)
        flight.controller.look(100, 20)
        flight.set_bookmark(2)
        poses.append(flight.controller.pose)
        flight.close()
    assert poses[2] == poses[1] != poses[0]
    assert Memory(tmp_path / "view.json").bookmarks("hills")[2] == poses[3]
    ctx.detect_framebuffer(0).use()
    overlay.release()
    target.release()


def test_at_rest_it_measures_and_draws_no_more(flight):
    settle(flight)
    measured = dict(flight.figures.measured_px)
    stats = flight.renderer.measure()
    assert measured == pytest.approx({"max": stats["max_error_px"], "rms": stats["rms_error_px"]}, rel=1e-9)
    assert measured["max"] <= stats["certified_max_error_px"] <= 1.0
    assert not later(flight, 1000.0)


def test_motion_is_drawn_and_ends_in_a_full_frame(flight):
    flight.settings.figures = False
    settle(flight)
    before = seen(flight)
    take_pace(flight, slow())
    for key in ("w", "shift"):
        flight.controller.press(key)
    assert later(flight) and flight.figures.shrunk == 4 and flight.renderer.size == (80, 50)
    assert later(flight, 0.1) and flight.figures.fps
    assert flight.figures.measured_px is None
    flight.controller.let_go("w")
    settle(flight)
    assert flight.renderer.size == (320, 200) and flight.figures.measured_px and flight.figures.fps is None
    arrived = seen(flight)
    assert not np.array_equal(arrived, before) and np.array_equal(arrived, drawn_at_once(flight))


def test_words_stand_over_the_picture_and_go(flight):
    settle(flight)
    with_figures = seen(flight)
    flight.press("i")
    later(flight)
    bare = seen(flight)
    flight.press("h")
    later(flight)
    with_keys = seen(flight)
    assert (with_figures != bare).any(-1)[:150, :150].mean() > 0.5
    assert (with_keys != bare).any(-1).mean() > 0.2


def test_messages_come_and_go(flight):
    settle(flight)
    flight.say("hello")
    assert later(flight) and len(flight.panels()) == 2
    assert later(flight, 100.0) and len(flight.panels()) == 1


def test_a_minimised_window_draws_nothing_and_comes_back(flight):
    settle(flight)
    flight.resize((0, 0))
    assert not later(flight)
    flight.resize((320, 200))
    assert later(flight)


def test_the_picture_is_saved_without_words_beside_earlier_ones(flight, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for _ in range(2):
        flight.message = ""
        flight.press("p")
        while not flight.message:
            later(flight)
            flight.keeping.join()
    assert sorted(path.name for path in tmp_path.glob("*.png")) == ["hills-001.png", "hills-002.png"]
    assert np.array_equal(load(tmp_path / "hills-001.png"), drawn_at_once(flight))
    assert json.loads((tmp_path / "hills-001.json").read_text())["triangles"] == flight.figures.stats["triangles"]
    assert (tmp_path / "hills-001.png").read_bytes() == (tmp_path / "hills-002.png").read_bytes()
    assert free_name("x/hills.tif").name == "hills-003.png"
    assert f"saved {tmp_path.resolve() / 'hills-002.png'}" in flight.message


def test_a_picture_that_cannot_be_saved_is_told(flight, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.rmtree(tmp_path)
    settle(flight)
    flight.press("p")
    while not flight.message:
        later(flight)
        flight.keeping.join()
    assert "saved" not in flight.message


def changed(picture, before):
    """Share of pixels that differ visibly."""
    return (np.abs(picture - before).max(-1) > 4).mean()


# --- Seeing how detail comes about --------------------------------------------------------------------------------


def test_a_click_explains_the_patch_and_a_drag_does_not(flight):
    settle(flight)
    flight.mouse.press("left", 160, 150)
    flight.mouse.point(200, 150)
    flight.mouse.let_go("left", 200, 150)
    assert flight.insight.explanation is None and flight.controller.pose != Pose.of(flight.controller.start)
    flight.controller.home()
    settle(flight)
    place = flight.mouse.place_under(160, 150)
    flight.mouse.press("left", 160, 150)
    flight.mouse.let_go("left", 160, 150)
    told = flight.insight.explanation
    col, row = place[0] / 10, 128 - place[1] / 10
    assert all(0 <= at - first <= told.side for at, first in zip((col, row), told.corner, strict=True))
    assert told.chosen.px <= 1 and lesson.title(told)
    verdicts = [row[-1] for row in lesson.rows(told)]
    assert verdicts.count("drawn") == 1 and {"too coarse", "finer than needed"} & set(verdicts)
    assert all(sentence.endswith(".") for sentence in lesson.reasons(told))
    settle(flight)
    flight.mouse.press("left", 160, 3)  # the sky
    flight.mouse.let_go("left", 160, 3)
    assert flight.insight.explanation is None


def test_every_patch_is_put_in_words():
    drawn = ((1, 8, 9.0, 4.0, 3.0), (0, 4, 5.0, 2.0, 1.5), (2, 4, 4.0, 2.0, 0.9), (8, 1, 0.0, 0.0, 0.0))
    choices = [Choice(*each) for each in drawn]
    for chosen in choices:
        for metric, tolerance, seen in (("max", 1.0, True), ("rms", math.inf, True), ("max", 0.0, False)):
            told = Explanation((8, 8), 8, 2, chosen, tuple(choices), (1.0, 2.0), 900.0, 0.3, seen, tolerance, metric)
            assert lesson.title(told) and len(lesson.rows(told)) == 4 and lesson.reasons(told)
    told = Explanation((8, 8), 8, 2, choices[2], tuple(choices), (1.0, 2.0), 900.0, 0.3, True, 1.0, "max")
    assert [row[-1] for row in lesson.rows(told)] == ["too coarse", "too coarse", "drawn", "finer than needed"]
    assert "0.9 px" in lesson.reasons(told)[1]


def test_frozen_levels_stay_while_the_eye_goes_on(flight):
    flight.settings.figures = False
    settle(flight)
    flight.settings.draw(style="lod")
    flight.press("l")
    settle(flight)
    before = flight.figures.stats["triangles"]
    flight.controller.pose = Pose.of(Camera((-400.0, -500.0, 700.0), (550.0, 200.0, 150.0)))
    settle(flight)
    assert flight.figures.stats["triangles"] == before and flight.figures.measured_px["max"] <= 1
    picture = seen(flight)
    orange = (np.abs(picture - [255, 205, 120]).max(-1) < 12).sum()
    flight.press("l")
    settle(flight)
    assert flight.figures.stats["triangles"] != before
    assert orange > 50 > (np.abs(seen(flight) - [255, 205, 120]).max(-1) < 12).sum()


def test_a_split_picture_shows_two_settings(flight):
    flight.settings.figures = False
    settle(flight)
    plain = seen(flight)
    flight.press("t")
    assert [side.method for side in flight.settings.sides] == ["sat", [m for m in METHODS if m != "sat"][0]]
    flight.settings.active = 1
    flight.settings.draw(style="normals", method="sat")
    flight.message = ""
    settle(flight)
    split = seen(flight)
    assert np.array_equal(split[:, :158], plain[:, :158]) and changed(split[:, 162:], plain[:, 162:]) > 0.4
    flight.mouse.press("left", 161, 100)
    flight.mouse.point(80, 100)
    flight.mouse.let_go("left", 80, 100)
    settle(flight)
    moved = seen(flight)
    assert flight.settings.divider == 0.25 and flight.insight.explanation is None
    assert np.array_equal(moved[:, :78], plain[:, :78]) and changed(moved[:, 82:160], plain[:, 82:160]) > 0.4
    flight.mouse.point(20, 50)
    assert flight.settings.active == 0
    flight.mouse.point(200, 50)
    assert flight.settings.active == 1
    flight.mouse.press("left", 200, 150)
    flight.mouse.let_go("left", 200, 150)
    assert flight.insight.explanation.tolerance_px == 1.0
    flight.press("t")
    settle(flight)
    flight.insight.explanation, flight.message = None, ""
    settle(flight)
    assert np.array_equal(seen(flight), plain)


def test_methods_without_a_promise_are_shown_and_told(flight):
    for method in METHODS:
        flight.settings.draw(method=method)
        settle(flight)
        flight.insight.explain(160, 150)
        promised = flight.figures.stats["certified_max_error_px"]
        assert (flight.insight.explanation is None) == (promised is None)


def test_the_magnifying_glass_shows_pixels_as_squares(flight):
    flight.settings.figures = False
    settle(flight)
    plain = seen(flight)
    flight.press("z")
    flight.scale = 0.3
    flight.mouse.point(160, 120)
    settle(flight)
    lens = seen(flight)
    for dx, dy in ((0, 0), (2, 1), (-3, 2)):  # the middle of the square of a pixel near the middle
        x, y = 160 + round(6 * (dx + 0.5)), 120 - round(6 * (dy + 0.5))
        assert np.array_equal(lens[y, x], plain[119 - dy, 160 + dx])
    assert np.array_equal(lens[:60], plain[:60])


def test_the_summed_area_table_gives_the_mean_of_a_box(flight):
    settle(flight)
    flight.press("u")
    flight.settings.box = 20
    for x in (120, 160, 200):
        flight.mouse.point(x, 140)
        settle(flight)
        x0, y0, x1, y1 = flight.insight.box.box
        true_mean = flight.renderer.heightmap.heights[y0:y1, x0:x1].mean()
        assert flight.insight.box.mean_m == pytest.approx(true_mean, abs=0.002)
    whole = lesson.box_around(flight.renderer, 64, 64, 129)
    assert whole.box == (0, 0, 129, 129) and whole.corners[:3] == (0, 0, 0)
    left, bottom, width, height = flight.insight.sums_frame
    picture = seen(flight)[200 - bottom - height : 200 - bottom, left : left + width]
    assert np.abs(picture - [115, 242, 140]).max(-1).min() < 5  # the corners that add


def test_wires_are_drawn_over_the_picture(flight):
    settle(flight)
    before = seen(flight)
    flight.press("n")
    settle(flight)
    brighter = (seen(flight) - before).min(-1) > 8
    assert 0.02 < brighter.mean() < 0.6


# --- Sculpting, films, command lines -----------------------------------------------------------------------------


def stroke(flight, start, end):
    """Draw the brush from one pixel to another."""
    flight.mouse.press("left", *start)
    later(flight)
    for share in (0.5, 1.0):
        flight.mouse.point(*(a + share * (b - a) for a, b in zip(start, end, strict=True)))
        later(flight)
    flight.mouse.let_go("left", *end)
    settle(flight)


def test_a_stroke_changes_the_land_and_the_promise_holds(flight):
    settle(flight)
    before = flight.renderer.heightmap.heights.copy()
    picture = seen(flight)
    pose = flight.controller.pose
    flight.press("b")
    settle(flight)
    flight.sculpting.editing.strength_m = 30.0
    stroke(flight, (150, 140), (190, 150))
    after = flight.renderer.heightmap.heights.copy()
    assert (after - before).max() > 20 and (after >= before).all() and flight.controller.pose == pose
    assert flight.figures.measured_px["max"] <= flight.figures.stats["certified_max_error_px"] <= 1
    assert changed(seen(flight), picture) > 0.01
    assert flight.sculpting.editing.strokes == (1, 0)
    rebuilt = Heightmap(after, 10.0)
    rebuilt.reach_m = flight.renderer.heightmap.reach_m
    built = ErrorTables(Terrain(flight.ctx, rebuilt))
    flight.press("ctrl+z")
    settle(flight)
    assert np.array_equal(flight.renderer.heightmap.heights, before)
    flight.press("ctrl+shift+z")
    settle(flight)
    assert np.array_equal(flight.renderer.heightmap.heights, after)
    for name in ("nodes", "gains", "counters", "squares", "blocks"):
        assert getattr(built, name).read() == getattr(flight.renderer.tables, name).read(), name
    built.terrain.release()
    built.release()
    flight.press("ctrl+z")
    flight.press("ctrl+z")
    assert "nothing" in flight.message


def test_undoing_is_seen_in_the_next_frame_and_soon_in_full(flight):
    """On a slow machine: coarsely at once, then in full, in the light that there is; then light follows."""
    settle(flight)
    untouched = seen(flight)
    flight.press("b")
    settle(flight)
    stroke(flight, (150, 140), (190, 150))
    take_pace(flight, slow())
    flight.press("ctrl+z")
    later(flight, 0.01)
    assert flight.painter.drawn == flight.wanted() and flight.figures.shrunk > 1
    while flight.figures.shrunk > 1:
        assert flight.painter.dawn.share is None
        later(flight)
    settle(flight)
    beside = np.s_[:, 270:]  # of the figures
    flight.press("b")
    settle(flight)
    assert (
        np.abs(seen(flight)[beside] - untouched[beside]).mean() < 2
    )  # heights are summed in the steps of a wider span
    assert flight.figures.measured_px


def test_room_for_the_brush_is_made_in_portions(flight):
    settle(flight)
    take_pace(flight, slow())
    flight.press("b")
    assert flight.progress == ("room for the brush", flight.sculpting.share, True) and flight.busy
    flight.press("escape")
    assert not flight.sculpting.room and not flight.done and flight.progress is None
    flight.press("b")
    frames = 0
    while not flight.sculpting.brushing:
        assert flight.figures.measured_px or frames == 0
        later(flight)
        frames += 1
    assert frames > 3 and "drag on the land" in flight.message
    flight.press("b")
    assert not flight.sculpting.brushing
    flight.press("b")
    assert flight.sculpting.brushing  # at once: there is room


def test_a_brush_that_is_held_goes_on(flight):
    settle(flight)
    flight.press("b")
    settle(flight)
    flight.mouse.press("left", 160, 150)
    later(flight)
    once = flight.renderer.heightmap.heights.copy()
    for _ in range(10):
        later(flight)
    assert (flight.renderer.heightmap.heights - once).max() > 5 * flight.sculpting.editing.strength_m
    flight.mouse.let_go("left", 160, 150)
    assert flight.sculpting.editing.strokes == (1, 0) and flight.insight.explanation is None


def test_a_held_brush_waits_for_room_and_goes_on(flight):
    """However far it raises the land: tables are exchanged for such with more room, never built anew in one go."""
    settle(flight)
    take_pace(flight, slow())
    flight.press("b")
    settle(flight)
    renderer, editing = flight.renderer, flight.sculpting.editing
    relief_m = np.ptp(renderer.heightmap.range_m)
    editing.strength_m = 0.3 * relief_m
    flight.mouse.press("left", 160, 150)
    waited = 0
    while renderer.heightmap.range_m[1] < 100 + 5 * relief_m:
        reach, heights, edited = renderer.heightmap.reach_m, renderer.terrain.heights, renderer.heightmap.range_m
        waits = flight.sculpting.room is not None
        later(flight)
        if waits and flight.sculpting.room:
            waited += 1
            assert renderer.heightmap.range_m == edited and flight.progress[0] == "room for the brush"
        assert renderer.heightmap.reach_m == reach or renderer.terrain.heights is not heights
    assert waited > 3 and editing.brush.strength == editing.strength_m
    flight.mouse.let_go("left", 160, 150)
    settle(flight)
    assert editing.strokes == (1, 0) and flight.figures.measured_px["max"] <= 1
    rebuilt = Heightmap(renderer.heightmap.heights, renderer.heightmap.spacing_m)
    rebuilt.reach_m = renderer.heightmap.reach_m
    with Renderer(rebuilt, ctx=flight.ctx) as built:
        assert built.tables.nodes.read() == renderer.tables.nodes.read()
    flight.press("ctrl+z")
    assert np.array_equal(renderer.heightmap.heights, hills().heights)


def waiting_stroke(flight):
    """A stroke whose dabs wait for room, the button still down; returns the brush."""
    editing = flight.sculpting.editing
    editing.strength_m = 3 * np.ptp(flight.renderer.heightmap.range_m)
    take_pace(flight, slow())
    flight.mouse.press("left", 160, 150)
    while not flight.sculpting.room:
        later(flight)
    return editing


def with_a_stroke(flight):
    """The brush in hand, one stroke done; the land before and after."""
    settle(flight)
    before = flight.renderer.heightmap.heights.copy()
    flight.press("b")
    settle(flight)
    stroke(flight, (100, 150), (130, 150))
    settle(flight)
    return before, flight.renderer.heightmap.heights.copy()


@pytest.mark.parametrize("key", ["escape", "b"])
def test_a_stroke_that_waits_for_room_can_be_given_up(flight, key):
    _, after = with_a_stroke(flight)
    editing = waiting_stroke(flight)
    flight.press(key)
    assert not (flight.sculpting.room or editing.due or flight.mouse.drag or flight.done)
    settle(flight)
    flight.mouse.let_go("left", 160, 150)
    settle(flight)
    assert flight.sculpting.brushing == (key == "escape") and flight.renderer._unsettled is None
    while editing.strokes[0] > 1:
        flight.press("ctrl+z")
    assert np.array_equal(flight.renderer.heightmap.heights, after)


@pytest.mark.parametrize("held", [True, False])
def test_undoing_a_stroke_that_waits_for_room_leaves_the_one_before(flight, held):
    before, after = with_a_stroke(flight)
    editing = waiting_stroke(flight)
    if not held:
        flight.mouse.let_go("left", 160, 150)
    flight.press("ctrl+z")
    assert np.array_equal(flight.renderer.heightmap.heights, after)
    if held:
        flight.mouse.let_go("left", 160, 150)
    take_pace(flight, swift())
    settle(flight)
    while editing.strokes[0] > 1:  # what was held went on as a stroke of its own
        flight.press("ctrl+z")
    assert np.array_equal(flight.renderer.heightmap.heights, after)
    flight.press("ctrl+z")
    assert np.array_equal(flight.renderer.heightmap.heights, before)


def test_strokes_that_wait_for_room_stay_strokes_of_their_own(flight):
    before, after = with_a_stroke(flight)
    editing = waiting_stroke(flight)
    flight.mouse.let_go("left", 160, 150)
    stroke(flight, (200, 150), (210, 150))
    take_pace(flight, swift())
    settle(flight)
    assert editing.strokes == (3, 0)
    flight.press("ctrl+z")
    flight.press("ctrl+z")
    assert np.array_equal(flight.renderer.heightmap.heights, after)


def test_undoing_while_the_button_is_down_begins_another_stroke(flight):
    before, after = with_a_stroke(flight)
    flight.mouse.press("left", 160, 150)
    later(flight)
    flight.press("ctrl+z")
    assert np.array_equal(flight.renderer.heightmap.heights, after)
    flight.mouse.point(180, 150)
    later(flight)
    flight.mouse.let_go("left", 180, 150)
    settle(flight)
    assert flight.sculpting.editing.strokes[0] == 2
    flight.press("ctrl+z")
    assert np.array_equal(flight.renderer.heightmap.heights, after)
    flight.press("ctrl+z")
    assert np.array_equal(flight.renderer.heightmap.heights, before)


def test_other_buttons_do_nothing_during_a_stroke(flight):
    with_a_stroke(flight)
    pose = flight.controller.pose
    flight.mouse.press("left", 160, 150)
    later(flight)
    flight.mouse.press("right", 160, 150)
    flight.mouse.point(190, 150)
    later(flight)
    flight.mouse.let_go("right", 190, 150)
    assert flight.mouse.drag == "brush" and flight.controller.pose == pose
    flight.mouse.let_go("left", 190, 150)
    settle(flight)
    assert flight.sculpting.editing.strokes == (2, 0) and flight.renderer._unsettled is None


def test_a_stroke_reaches_where_the_button_came_up(flight):
    """Also one that was done between two frames."""
    settle(flight)
    flight.press("b")
    settle(flight)
    end = flight.mouse.place_under(240, 150)
    flight.mouse.press("left", 120, 150)
    flight.mouse.point(240, 150)
    flight.mouse.let_go("left", 240, 150)
    settle(flight)
    col, row = round(end[0] / 10), round(128 - end[1] / 10)
    raised_m = (flight.renderer.heightmap.heights - hills().heights)[row, col]
    assert raised_m > 0.5 * flight.sculpting.editing.strength_m


def test_light_follows_a_stroke_of_a_single_portion(flight):
    settle(flight)
    flight.press("b")
    settle(flight)
    take_pace(flight, slow())
    flight.mouse.press("left", 160, 150)
    flight.mouse.let_go("left", 160, 150)
    while flight.sculpting.at_work:
        later(flight, 0.01)
    assert flight.sculpting.editing.strokes == (1, 0) and flight.renderer._unsettled is None


def test_a_map_that_comes_during_a_stroke_is_not_sculpted_by_it(flight):
    with_a_stroke(flight)
    flight.mouse.press("left", 160, 150)
    later(flight)
    heightmap = Heightmap(hills().heights + 50, 10.0, "other")
    flight.land.show(Renderer(heightmap, (32, 20), ctx=flight.ctx), Opened(heightmap, Camera.default(heightmap)))
    for _ in range(5):
        later(flight)
    flight.mouse.let_go("left", 160, 150)
    settle(flight)
    assert flight.sculpting.editing.strokes == (0, 0) and not flight.sculpting.unsaved
    assert np.array_equal(flight.renderer.heightmap.heights, heightmap.heights)


def test_the_land_is_not_sculpted_while_it_is_made_higher(flight):
    """What was done would be lost; the brush is held as it was when it is there."""
    _, after = with_a_stroke(flight)
    editing = flight.sculpting.editing
    editing.tool, editing.radius_m = "cliff", 77.0
    flight.land.exaggerate(2.0)
    flight.mouse.press("left", 160, 150)
    flight.mouse.let_go("left", 160, 150)
    assert "higher or lower" in flight.message and not editing.due
    flight.press("ctrl+z")
    assert np.array_equal(flight.renderer.heightmap.heights, after)
    settle(flight)
    now = flight.sculpting.editing
    assert np.allclose(flight.renderer.heightmap.heights, 2 * after) and flight.sculpting.unsaved
    assert (now.tool, now.radius_m, now.strength_m) == ("cliff", 77.0, pytest.approx(2 * editing.strength_m))
    flight.factor = 3.0
    flight.land.exaggerate(3.0)
    flight.land.cancel()
    assert flight.factor == flight.land.exaggeration == 2.0


@pytest.mark.parametrize("lead", range(1, 30, 2))
def test_room_may_be_made_while_the_picture_comes_to_rest(flight, lead):
    settle(flight)
    take_pace(flight, slow())
    flight.press("b")
    for _ in range(lead):
        later(flight, 0.05)
    flight.controller.look(3, 0)
    flight.refresh()
    for _ in range(40):
        later(flight, 0.3)
    settle(flight)
    assert flight.sculpting.brushing and flight.figures.measured_px["max"] <= 1


def test_no_memory_for_room_is_told_and_one_sculpts_all_the_same(flight, monkeypatch):
    settle(flight)

    def reserve(*_):
        raise TerrainError("an error table of 9 GiB is more than there is")

    with monkeypatch.context() as patched:
        patched.setattr("terrain_gl.error.gl.reserve", reserve)
        flight.press("b")
        settle(flight)
    assert "9 GiB" in flight.message and flight.sculpting.brushing
    flight.sculpting.editing.strength_m = 1000.0
    stroke(flight, (160, 150), (165, 150))
    settle(flight)
    assert flight.renderer.heightmap.range_m[1] > 900 and flight.figures.measured_px["max"] <= 1


def test_what_is_sculpted_is_not_lost_unasked(flight, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with_a_stroke(flight)
    flight.press("escape")
    flight.press("escape")
    assert not flight.done and "not saved" in flight.message
    flight.land.open("alpine")  # asked again
    assert flight.land.loading
    flight.land.cancel()
    flight.press("b")
    settle(flight)
    flight.mouse.press("left", 160, 150)
    flight.press("ctrl+s")
    assert "brush is still at work" in flight.message
    flight.mouse.let_go("left", 160, 150)
    settle(flight)
    flight.land.open("alpine")
    assert not flight.land.loading and "not saved" in flight.message
    flight.press("ctrl+s")
    flight.sculpting.join()
    later(flight)
    assert str(tmp_path) in flight.message and not flight.sculpting.unsaved
    flight.press("escape")
    flight.press("escape")
    assert flight.done


def test_the_distance_between_posts_is_told_and_set(empty, tmp_path):
    said, say = [], empty.say
    empty.say = lambda text, *seconds: (said.append(text), say(text, *seconds))
    np.save(tmp_path / "plain.npy", hills().heights)
    empty.land.open(str(tmp_path / "plain.npy"))
    settle(empty)
    assert "1 m is assumed" in said.pop() and empty.renderer.heightmap.spacing_m == (1.0, 1.0)
    empty.space("30")
    settle(empty)
    assert empty.renderer.heightmap.spacing_m == (30.0, 30.0) and empty.figures.measured_px["max"] <= 1
    assert not said
    for words in ("x", "-3", "nan"):
        empty.space(words)
        settle(empty)
        assert "spacing" in said.pop() and empty.renderer.heightmap.spacing_m == (30.0, 30.0)


def test_a_long_stroke_is_done_in_portions_after_the_button_is_up(flight):
    """As one stroke, the same as dab by dab."""
    settle(flight)
    flight.press("b")
    settle(flight)
    take_pace(flight, slow())
    start, end = flight.mouse.place_under(60, 150), flight.mouse.place_under(280, 170)
    brush, plain = flight.sculpting.editing.brush, Heightmap(hills().heights, 10.0)
    for middle in [tuple(start[:2]), *places(tuple(start[:2]), tuple(end[:2]), 0.3 * brush.radius_m)]:
        patch = dab(plain, brush, *middle)
        plain.heights[patch.rows, patch.cols] = patch.heights
    flight.mouse.press("left", 60, 150)
    later(flight, 0.01)
    flight.mouse.point(280, 170)
    later(flight, 0.01)
    flight.mouse.let_go("left", 280, 170)
    left = [len(flight.sculpting.editing.due)]
    while flight.sculpting.at_work:
        assert flight.busy
        later(flight)
        left.append(len(flight.sculpting.editing.due))
    assert len(left) > 3 and left == sorted(left, reverse=True)
    settle(flight)
    assert np.array_equal(flight.renderer.heightmap.heights, plain.heights)
    assert flight.sculpting.editing.strokes == (1, 0) and flight.figures.measured_px["max"] <= 1
    flight.press("ctrl+z")
    assert np.array_equal(flight.renderer.heightmap.heights, hills().heights)


@pytest.mark.parametrize("seed", range(8))
def test_whatever_one_does_tables_and_promise_hold(flight, seed, tmp_path, monkeypatch):
    """Random keys, strokes, sizes and frames in any order, at a pace that does a portion of everything a frame."""
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(seed)
    settle(flight)
    take_pace(flight, slow())
    keys = [key for key in BY_KEY if key not in ("ctrl+s", "r", "p", "o")]
    does = {
        "frame": lambda: later(flight, rng.choice([0.01, 0.05, 0.3, 1.0])),
        "key": lambda: flight.press(rng.choice(keys)),
        "sculpt": lambda: flight.press(rng.choice(["b", "ctrl+z", "ctrl+shift+z", "escape", "x"])),
        "press": lambda: flight.mouse.press(rng.choice(["left", "right"]), *rng.uniform((0, 60), (320, 200))),
        "point": lambda: flight.mouse.point(*rng.uniform((0, 40), (320, 200))),
        "let go": lambda: flight.mouse.let_go(rng.choice(["left", "right"]), *rng.uniform((0, 60), (320, 200))),
        "raise": lambda: flight.land.exaggerate(rng.choice([0.5, 1.0, 2.0])),
        "size": lambda: flight.resize(((320, 200), (0, 0), (1, 1), (160, 120))[rng.integers(4)]),
    }
    often = np.array([45, 6, 12, 12, 10, 11, 2, 2])
    for name in rng.choice(list(does), 100, p=often / often.sum()):
        does[name]()
        flight.done = False
    flight.resize((320, 200))
    take_pace(flight, swift())
    for button in ("left", "right"):
        flight.mouse.let_go(button, 160, 150)
    flight.controller.let_go_all()
    settle(flight)
    renderer, measured = flight.renderer, flight.figures.measured_px
    assert renderer._unsettled is None and not flight.sculpting.at_work
    if measured and flight.certified_px is not None:
        assert measured[flight.figures.stats["metric"]] <= flight.certified_px
    rebuilt = Heightmap(renderer.heightmap.heights, renderer.heightmap.spacing_m)
    rebuilt.reach_m = renderer.heightmap.reach_m
    built = ErrorTables(Terrain(flight.ctx, rebuilt))
    for name in ("nodes", "gains", "counters", "squares", "blocks"):
        assert getattr(built, name).read() == getattr(renderer.tables, name).read(), name
    built.terrain.release()
    built.release()


def test_every_tool_is_at_hand(flight):
    settle(flight)
    flight.press("b")
    tools = set()
    for _ in TOOLS:
        flight.press("x")
        tools.add(flight.sculpting.editing.tool)
        before = flight.sculpting.editing.brush
        for key in ("]", ".", "]", "."):
            flight.press(key, again=True)
        brush = flight.sculpting.editing.brush
        assert brush.radius_m > before.radius_m and brush.strength > before.strength
        for key in ("[", ","):
            for _ in range(500):
                flight.press(key)
        assert flight.sculpting.editing.brush.radius_m > 0 and flight.sculpting.editing.brush.strength > 0
    assert tools == set(TOOLS)
    flight.press("escape")
    assert not flight.sculpting.brushing and not flight.done


@pytest.mark.parametrize("suffix", [".tif", ".png", ".exr"])
def test_the_land_is_saved_and_opens_again(flight, tmp_path, suffix):
    settle(flight)
    flight.land.exaggerate(2.0)
    settle(flight)
    heights = flight.renderer.heightmap.heights / 2
    path = tmp_path / f"land{suffix}"
    flight.sculpting.save(str(path))
    flight.sculpting.saving.join()
    settle(flight)
    assert "saved" in flight.message and "--spacing" in flight.message
    words = flight.message.split("open it again: ")[1].split()
    options = dict(zip(words[::2], words[1::2], strict=True))
    scales = {"z_scale": float(options.get("--z-scale", 1)), "z_offset_m": float(options.get("--z-offset", 0))}
    again = Heightmap.open(path, spacing_m=10.0, **scales)
    assert np.abs(again.heights - heights).max() <= scales["z_scale"] / 2 if suffix == ".png" else again.heights.size
    if suffix != ".png":
        assert np.array_equal(again.heights, heights)


def test_what_cannot_be_saved_is_told(flight, tmp_path):
    settle(flight)
    for path in ("land.doc", str(tmp_path / "nowhere" / "land.tif")):
        flight.sculpting.save(path)
        if flight.sculpting.saving:
            flight.sculpting.saving.join()
        later(flight)
        assert flight.sculpting.saving is None and flight.message and not flight.message.startswith("saved")


def test_a_film_is_recorded(flight, tmp_path, monkeypatch):
    pytest.importorskip("av", reason="the extra [video] is not installed")
    monkeypatch.chdir(tmp_path)
    settle(flight)
    flight.press("r")
    flight.controller.press("d")
    for _ in range(12):
        later(flight, 0.1)
    flight.controller.let_go_all()
    flight.press("r")
    flight.keeping.filming.join()
    import av

    with av.open(str(tmp_path / "hills-001.mp4")) as film:
        frames = [frame.to_ndarray(format="rgb24") for frame in film.decode(video=0)]
    assert len(frames) > 5 and frames[0].shape == (200, 320, 3)
    assert changed(frames[-1].astype(int), frames[0].astype(int)) > 0.01


def test_a_film_that_cannot_be_written_is_told_and_the_flight_goes_on(flight, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    settle(flight)
    monkeypatch.setattr("terrain_gl.viewer.keeping.free_name", lambda *_: tmp_path / "nowhere" / "film.mp4")
    flight.press("r")
    for _ in range(5):
        later(flight)
    assert not flight.keeping.filming.running and flight.message
    monkeypatch.setattr("terrain_gl.viewer.keeping.free_name", lambda *_: tmp_path / "pictures")
    flight.press("r")
    later(flight)
    flight.resize((300, 180))  # a film has one size
    for _ in range(5):
        later(flight)
    assert not flight.keeping.filming.running and "ended" in flight.message


def test_the_view_is_told_as_a_command_line(flight):
    settle(flight)
    told = []
    flight.keeping.line_of = lambda *view: told.append(view) or "terrain-gl shot hills"
    flight.keeping.on_copy = told.append
    flight.press("y")
    heightmap, camera, size, drawing = told[0]
    assert (camera, size, drawing) == (flight.controller.camera, (320, 200), flight.settings.drawing)
    assert told[1] == "terrain-gl shot hills" and "shot hills" in flight.message


def test_an_exaggerated_map_is_told_as_a_command_line(flight, tmp_path):
    heights = np.random.default_rng(3).integers(0, 900, (40, 30)).astype("u2")
    np.save(tmp_path / "land.npy", heights)
    flight.land.open(str(tmp_path / "land.npy"))
    settle(flight)
    flight.land.exaggerate(2.7)
    settle(flight)
    flight.land.exaggerate(1.3)
    settle(flight)
    told = []
    flight.keeping.line_of, flight.keeping.on_copy = command_line, told.append
    flight.press("y")
    words = shlex.split(told[0])
    assert words[words.index("--z-scale") + 1] == "1.3"
    again = Heightmap.open(words[2], z_scale=1.3)
    assert np.array_equal(again.heights, flight.renderer.heightmap.heights) and again.heights.max() > 1000


def test_a_picture_of_any_size_is_what_the_renderer_draws(flight, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(SIZES, "large", (450, 260))
    flight.keeping.size = "large"
    settle(flight)
    seen_before = seen(flight)
    take_pace(flight, slow())
    flight.press("p")
    later(flight)
    assert flight.progress == ("drawing hills-001.png", flight.keeping.shot.share, True)
    flight.press("escape")
    assert not flight.keeping.shot and not flight.done and flight.message == "cancelled"
    flight.press("b")
    settle(flight)
    flight.press("p")
    later(flight)
    flight.mouse.press("left", 160, 150)
    flight.mouse.let_go("left", 160, 150)
    assert not flight.keeping.shot and "land has changed" in flight.message and not list(tmp_path.iterdir())
    flight.press("ctrl+z")
    flight.press("b")
    for split in (False, True):
        if split:
            flight.press("t")
            flight.settings.sides[1] = Drawing(style="normals")
            flight.settings.divider = 0.4
        flight.press("p")
        while flight.keeping.shot:
            later(flight)
        flight.keeping.join()
    whole, parts = (load(tmp_path / f"hills-00{i}.png") for i in (1, 2))
    with Renderer(flight.renderer.heightmap, (450, 260), ctx=flight.ctx) as renderer:
        shaded, normals = (
            renderer.render(flight.controller.camera, style=style).image[..., :3] for style in ("shaded", "normals")
        )
    assert np.array_equal(whole, shaded)
    assert np.array_equal(parts, np.concatenate([shaded[:, :180], normals[:, 180:]], 1))
    numbers = json.loads((tmp_path / "hills-002.json").read_text())
    assert [side["width"] for side in numbers] == [450, 450] and numbers[0]["triangles"] > 100
    flight.press("t")
    take_pace(flight, swift())
    flight.message = ""
    settle(flight)
    assert changed(seen(flight)[:, 250:], seen_before[:, 250:]) == 0


def test_a_sky_and_water_from_the_panel(flight, tmp_path):
    settle(flight)
    sunny = seen(flight)
    for path, words in (("gone.hdr", "gone.hdr"), (str(tmp_path), "")):
        flight.dressing.wear("sky", path)
        flight.dressing.join()
        later(flight)
        assert words in flight.message and "\n" not in flight.message and flight.settings.drawing.sky is None
    red = np.zeros((16, 32, 3), "f4")
    red[..., 0] = 1.0
    write_image(tmp_path / "red.exr", red)
    flight.dressing.wear("sky", f" {tmp_path / 'red.exr'} ")
    settle(flight)
    under_red = seen(flight)
    assert flight.settings.drawing.sky == str(tmp_path / "red.exr")
    assert (under_red[:, 200:, 0] > 4 * under_red[:, 200:, 1]).mean() > 0.9
    flight.dressing.wear("sky", "")
    settle(flight)
    assert np.array_equal(seen(flight)[:, 250:], sunny[:, 250:])
    flight.settings.draw_both(water_m=100.0)
    settle(flight)
    assert changed(seen(flight), sunny) > 0.1


@pytest.mark.parametrize("ending", FORMATS)
def test_the_mesh_is_saved_as_it_is_drawn(flight, tmp_path, monkeypatch, ending):
    monkeypatch.chdir(tmp_path)
    settle(flight)
    take_pace(flight, slow())
    flight.controller.look(40, 0)
    later(flight)  # what is seen is coarse
    flight.keeping.mesh_format = ending
    flight.press("o")
    flight.keeping.join()
    told = int(flight.message.split(": ")[1].split()[0].replace(",", ""))
    content = (tmp_path / f"hills-001{ending}").read_bytes()
    settle(flight)
    assert told == flight.figures.stats["triangles"]
    if ending == ".ply":
        assert f"element face {told}\n".encode() in content
    elif ending == ".obj":
        assert content.count(b"\nf ") == told
    flight.controller.look(0, -10000)  # the sky
    flight.press("o")
    assert "no triangles" in flight.message


def test_bookmarks_become_a_path(flight, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    flight.press("k")
    assert "bookmarks" in flight.message and not list(tmp_path.iterdir())
    flight.press("ctrl+2")
    flight.controller.look(200, 0)
    flight.press("ctrl+1")
    flight.press("k")
    path = CameraPath.open("hills-001-path.json")
    assert [frame.camera.eye for frame in path.keyframes] == [flight.controller.bookmarks[n].eye for n in (1, 2)]
    assert "fly MAP --path hills-001-path.json" in flight.message  # these hills have no file
    flight.land.opened = replace(flight.land.opened, key="alpine")
    flight.press("k")
    assert "fly alpine --path hills-002-path.json" in flight.message


def test_legends_show_the_colours_of_the_shaders():
    text = files("terrain_gl.glsl").joinpath("shade/drawn.glsl").read_text()
    for name, ramp in (("viridis", legend.VIRIDIS), ("inferno", legend.INFERNO)):
        body = text[text.index(f"vec3 {name}(") :]
        colours = re.findall(r"vec3\(([\d., ]+)\)", body[: body.index("}")])
        assert [tuple(map(float, colour.split(","))) for colour in colours] == list(ramp)
    assert set(legend.COLOURS) <= set(STYLES)
    for style in STYLES:
        shown = legend.legend(Drawing(2.0, style=style))
        assert (shown is not None) == (style in ("lod", "segments", "promise", "error"))


# --- Panels, without a window -----------------------------------------------------------------------------------------


@pytest.fixture
def panels(ctx):
    """A flight with panels, in a picture as large as a window."""
    pytest.importorskip("imgui_bundle", reason="the extra [gui] is not installed")
    heightmap, size = hills(), (900, 640)
    target, overlay, gui = ctx.framebuffer([ctx.texture(size, 4)]), Overlay(ctx), Gui(ctx)
    plain = Settings([Drawing(style="lambert")])  # light takes its time, and is looked at elsewhere
    flight = Flight(overlay, target, size, plain, gui=gui, pace=swift())
    opened = Opened(heightmap, Camera.default(heightmap), key="hills")
    flight.land.show(Renderer(heightmap, (320, 200), ctx=ctx), opened)
    settle(flight)
    yield flight
    flight.close()
    ctx.detect_framebuffer(0).use()
    gui.release()
    overlay.release()
    target.release()


def drag(flight, start, end):
    """Press the left button at one place, let it go at another; frames in between."""
    flight.gui.move(*start)
    later(flight, 0.1)
    flight.gui.button("left", True)
    later(flight, 0.1)
    flight.gui.move(*end)
    later(flight, 0.1)
    flight.gui.button("left", False)
    settle(flight)


def slider(flight, label):
    """Where a slider's middle is, and its width."""
    return flight.gui.places[label]


def test_panels_stand_at_the_left_and_leave_the_middle_free(panels):
    with_panel = seen(panels)
    panels.press("i")
    settle(panels)
    bare = seen(panels)
    differ = (with_panel != bare).any(-1)
    assert differ[20:300, 20:200].mean() > 0.9 and not differ[:, 450:].any()
    assert panels.gui.covers(100, 100) is False


def test_panels_of_two_flights_know_nothing_of_each_other(panels):
    heightmap, size = hills(), panels.size
    target, gui = panels.ctx.framebuffer([panels.ctx.texture(size, 4)]), Gui(panels.ctx)
    other = Flight(panels.overlay, target, size, Settings([Drawing(style="lambert")]), gui=gui, pace=swift())
    opened = Opened(heightmap, Camera.default(heightmap), key="hills")
    other.land.show(Renderer(heightmap, (320, 200), ctx=panels.ctx), opened)
    settle(other)
    assert changed(seen(other), seen(panels)) < 0.05  # the graphs of times differ
    gui.opened["Map"] = not gui.opened["Map"]
    for flight in (other, panels):
        settle(flight)
    assert changed(seen(other), seen(panels)) > 0.05
    other.close()
    gui.release()
    target.release()
    before = panels.figures.stats["triangles"]
    panels.settings.loosen(2)
    settle(panels)
    assert panels.figures.stats["triangles"] < before


def test_a_slider_is_dragged_and_the_mesh_follows(panels):
    before = panels.figures.stats["triangles"]
    left, top, right, bottom = slider(panels, "tolerance")
    middle = (top + bottom) / 2
    assert panels.gui.covers(left, middle) and not panels.gui.covers(700, 400)
    drag(panels, ((left + right) / 2, middle), (left + 0.8 * (right - left), middle))
    assert panels.settings.drawing.max_error_px > 10
    assert panels.figures.stats["triangles"] < before
    assert panels.figures.stats["requested_max_error_px"] == panels.settings.drawing.max_error_px


def test_a_box_is_ticked_and_a_choice_made(panels):
    panels.resize((600, 640))
    settle(panels)
    for label in ("colours", "metric", "method"):
        left, top, right, bottom = slider(panels, label)
        drag(panels, (left + 20, (top + bottom) / 2), (left + 20, (top + bottom) / 2))
        height = bottom - top
        place = left + 20, bottom + 1.6 * height  # the second of the list that came down
        drag(panels, place, place)
    drawing = panels.settings.drawing
    assert (drawing.style, drawing.metric, drawing.method) == (list(legend.COLOURS)[1], METRICS[1], METHODS[1])


def test_esc_closes_a_list_and_nothing_else(panels):
    left, top, right, bottom = slider(panels, "metric")
    at = left + 20, (top + bottom) / 2
    drag(panels, at, at)
    settle(panels)
    assert panels.gui.covers(890, 600)  # whatever is clicked next belongs to the list
    panels.press("escape")
    settle(panels)
    assert not panels.done and not panels.gui.covers(890, 600)
    panels.press("escape")
    assert panels.done


def test_a_path_is_typed(panels, tmp_path):
    np.save(tmp_path / "slope.npy", np.add.outer(np.arange(40.0), np.arange(30.0)))
    panels.gui.opened |= {"Map": True, "Understand": False}
    settle(panels)
    left, top, right, bottom = panels.gui.places["file"]
    middle = left + 20, (top + bottom) / 2
    drag(panels, middle, middle)
    assert panels.gui.writes and panels.gui.at(*middle) == "file"
    for character in str(tmp_path / "slope.npy"):
        panels.gui.write(ord(character))
    settle(panels)
    panels.gui.key("enter", True)
    panels.gui.key("enter", False)
    settle(panels)
    assert panels.figures.name == "slope.npy" and panels.settings.drawing.style == "lambert"


def test_every_control_has_a_line_of_help(panels):
    for title in panels.gui.opened:
        panels.gui.opened[title] = True
    settle(panels)
    assert len(panels.gui.places) > 20
    silent = [label for label, text in panels.gui.hints.items() if not 10 < len(text) < 160]
    assert silent == [] and set(panels.gui.hints) == set(panels.gui.places)


def test_the_error_is_measured_and_drawn(panels):
    records = panels.painter.history.records
    assert records[-1].measured_px is not None and records[-1].measured_px <= records[-1].promised_px
    panels.settings.loosen(2)
    settle(panels)
    assert len(records) >= 2 and records[-1].triangles < records[0].triangles
    assert records[0].measured_px < records[-1].measured_px <= records[-1].promised_px <= 2


def test_exaggeration_raises_the_land_and_the_promise_holds(panels):
    heights, eye = panels.renderer.heightmap.heights.copy(), panels.controller.pose.eye
    for factor in (2.5, 1.0):
        panels.land.exaggerate(factor)
        settle(panels)
        assert np.array_equal(panels.renderer.heightmap.heights, heights * np.float32(factor))
        assert panels.controller.pose.eye[2] == pytest.approx(eye[2] * factor)
        assert panels.figures.measured_px["max"] <= 1


def test_panels_are_larger_on_a_fine_screen(panels):
    before = slider(panels, "tolerance")
    panels.gui.scale = 1.5
    settle(panels)
    after = slider(panels, "tolerance")
    assert (after[3] - after[1]) == pytest.approx(1.5 * (before[3] - before[1]), rel=0.1)


def test_the_help_page_has_every_key(panels):
    panels.press("h")
    settle(panels)
    assert panels.gui.covers(450, 320)
    with_help = seen(panels)
    panels.press("escape")
    settle(panels)
    assert changed(seen(panels), with_help) > 0.2


def test_the_help_page_is_read_to_its_end_in_a_small_window(panels):
    panels.press("i")
    panels.resize((400, 260))
    panels.press("h")
    settle(panels)
    top = seen(panels)
    panels.gui.move(200, 150)
    for _ in range(100):
        panels.gui.wheel(0, -5)
        settle(panels)
    bottom = seen(panels)
    assert changed(bottom, top) > 0.05
    panels.gui.wheel(0, -5)
    settle(panels)
    assert np.array_equal(seen(panels), bottom)  # there is an end


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
viewer.run(Heightmap(np.load(sys.argv[1]), 10.0, "hills"), size=(640, 480), gui=False, style="lambert")
"""


_CLOSE = """
import sys
from terrain_gl.viewer import window
from terrain_gl.viewer.loading import file_opener
class Hasty(window.Window):
    def _turn(self):
        super()._turn()
        if self._now > float(sys.argv[2]):
            assert self._flight.land.loading or self._now > 60, "already loaded"
            self._glfw.set_window_should_close(self._handle, True)
    def close(self):
        print(self.ctx.error)
        super().close()
window.Window = Hasty
window.run(file_opener(sys.argv[1]), size=(320, 240), fresh=True)
"""


# tells, turn by turn, what the flight is at; a file named `drop` is dropped on the window, as GLFW would tell of it
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
            self._on_drop(None, [os.path.abspath("dropped.npy")])
        flight = self._flight
        state = {"busy": flight.busy, "message": flight.message, "recording": flight.keeping.filming.running}
        if flight.has_map:
            state |= {"name": flight.figures.name, "sides": len(flight.settings.sides)}
            state |= {"frozen": bool(flight.insight.frozen), "explained": bool(flight.insight.explanation)}
            state |= {"strokes": flight.sculpting.editing.strokes}
            state |= {"eye": list(flight.controller.eye), "mode": flight.controller.mode, "size": flight.size}
            state |= {"measured": flight.figures.measured_px, "promised": flight.certified_px}
        with open("state.part", "w") as file:
            json.dump(state, file)
        os.replace("state.part", "state.json")
    def close(self):
        print(self.ctx.error)
        super().close()
window.Window = Telling
window.run(Heightmap(np.load("hills.npy"), 10.0, "hills"), size=(320, 240), fresh=True, gui=False)
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
            self.environment = os.environ | {"DISPLAY": f":{pipe.readline().strip()}", "XDG_STATE_HOME": str(folder)}

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

    def wait(self, condition, what, seconds=120):  # there are slow machines
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


def is_orange(pixels):
    return (pixels[..., 0] > 150) & (pixels[..., 2] < 130)


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

        before = screen.pixels()
        screen.do("key", "h")
        screen.wait(lambda: (screen.pixels() != before).any(-1)[120:360, 250:390].mean() > 0.5, "the keys")
        while not has_figures(screen):  # keys take some pages; then the figures are back
            page = screen.pixels()
            screen.do("key", "h")
            screen.wait(lambda page=page: (screen.pixels() != page).any(), "another page")
        screen.do("key", "minus", "key", "m", *["key", "shift+Tab"] * 3, "key", "Home")
        assert np.array_equal(picture(3), first)

        screen.do("search", "--name", "hills", "windowsize", 500, 300)
        screen.wait(lambda: screen.pixels()[310:, 510:].max() == 0, "the smaller window")
        assert picture(4).shape[:2] == (300, 500)
        assert has_figures(screen)

        screen.do("key", "Escape")
        output, errors = process.communicate(timeout=120)
    assert (process.returncode, output.strip(), errors) == (0, "GL_NO_ERROR", "")


def test_a_session_with_real_events(screen, tmp_path):
    """Flies, edits, splits, freezes, records, opens what is dropped, and quits; no OpenGL error."""
    np.save(tmp_path / "hills.npy", hills().heights)
    np.save(tmp_path / "dropped.npy", np.add.outer(np.arange(50.0), np.arange(40.0)))
    with running(screen, "-c", _TELL, cwd=tmp_path) as process:

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
        does(lambda s: not s["recording"], "key", "r")
        does(lambda s: s["mode"] == "walk", "key", "v")
        does(lambda s: s["mode"] == "fly", "key", "Home")
        does(lambda s: s["explained"], "mousemove", 160, 180, "click", 1)
        does(lambda s: "brush" in s["message"], "key", "b")
        screen.do("mousemove", 140, 180, "mousedown", 1, "mousemove", 180, 185, "sleep", 0.2, "mouseup", 1)
        does(lambda s: s["strokes"] == [1, 0])
        does(lambda s: s["measured"] and s["measured"]["max"] <= s["promised"] <= 1)
        does(lambda s: s["strokes"] == [0, 1], "key", "ctrl+z")
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
        screen.do("key", "Escape")
        output, errors = process.communicate(timeout=120)
    assert (process.returncode, output.strip(), errors) == (0, "GL_NO_ERROR", "")
    assert list(tmp_path.glob("hills-001*"))  # the film, or a folder of pictures


def test_a_file_from_a_file_manager(screen, tmp_path):
    """Dropped by the X server's own protocol: what there is to be had, where, and the file itself."""
    pytest.importorskip("Xlib", reason="no python-xlib here, to drop files with: pip install python-xlib")
    from xdnd import drop

    np.save(tmp_path / "hills.npy", hills().heights)
    dropped = tmp_path / "dropped % ä.npy"
    np.save(dropped, np.add.outer(np.arange(50.0), np.arange(40.0)))
    with running(screen, "-c", _TELL, cwd=tmp_path) as process:
        state = tmp_path / "state.json"
        screen.wait(lambda: state.exists() and json.loads(state.read_text()).get("measured"), "the first map")
        assert drop(screen.environment["DISPLAY"], (200, 150), [dropped])
        screen.wait(lambda: json.loads(state.read_text())["name"] == dropped.name, "the map that was dropped")
        (tmp_path / "broken.tif").write_text("no map")
        assert drop(screen.environment["DISPLAY"], (200, 150), [tmp_path / "broken.tif"])
        screen.wait(lambda: "broken.tif" in json.loads(state.read_text())["message"], "a line about what is no map")
        assert json.loads(state.read_text())["name"] == dropped.name
        screen.do("search", "--sync", "--name", "hills", "windowfocus", "key", "Escape")
        output, errors = process.communicate(timeout=120)
    assert (process.returncode, output.strip(), errors) == (0, "GL_NO_ERROR", "")


def test_view_command(screen, tmp_path):
    command = [
        "-m",
        "terrain_gl",
        "view",
        "--size",
        "320x240",
        "--fresh",
        "--plain",
        "--json",
        "last.json",
        "--backend",
        "egl",
    ]
    with running(screen, *command, cwd=tmp_path) as process:
        screen.wait(lambda: has_figures(screen), "the first picture")
        screen.do("search", "--sync", "--name", "terrain-gl", "windowfocus", "key", "Escape")
        output, errors = process.communicate(timeout=120)
    assert (process.returncode, output, errors) == (0, "", "")
    last = json.loads((tmp_path / "last.json").read_text())
    assert last["map"] == "alpine" and last["triangles"] > 100


def test_panels_in_a_window(screen, tmp_path):
    pytest.importorskip("imgui_bundle", reason="the extra [gui] is not installed")
    command = ["-m", "terrain_gl", "view", "canyon", "--size", "640x480", "--fresh", "--json", "last.json"]
    with running(screen, *command, cwd=tmp_path) as process:
        screen.wait(lambda: 0 < screen.pixels()[14:40, 10:280].mean() < 60, "the panel's title")
        screen.do("search", "--sync", "--name", "terrain-gl", "windowfocus")
        screen.wait(lambda: screen.pixels()[200:470, 350:630].std() > 20, "the picture")
        screen.wait(lambda: (is_orange(screen.pixels()[:, 15:200]).sum(1) > 5).sum() > 8, "sliders")
        rows = np.flatnonzero(is_orange(screen.pixels()[:, 15:200]).sum(1) > 5)
        knob = slice(rows[0] - 2, rows[0] + 14)  # the first slider is the tolerance
        assert not is_orange(screen.pixels()[knob, 145:160]).any()
        screen.do("mousemove", 150, rows[0] + 6, "click", 1, "mousemove", 500, 300)
        screen.wait(lambda: is_orange(screen.pixels()[knob, 145:160]).any(), "the slider's knob")
        screen.do("key", "Escape")
        output, errors = process.communicate(timeout=120)
    assert (process.returncode, output, errors) == (0, "", "")
    last = json.loads((tmp_path / "last.json").read_text())
    assert last["requested_max_error_px"] > 3 and last["certified_max_error_px"] <= last["requested_max_error_px"]


@pytest.mark.parametrize("waited_s", [0.3, 0.7, 1.1])
def test_closing_during_a_load_exits_cleanly(screen, tmp_path, waited_s):
    np.save(tmp_path / "large.npy", np.add.outer(np.arange(3000.0) % 17, np.arange(2800.0) % 23).astype("f4"))
    with running(screen, "-c", _CLOSE, "large.npy", waited_s, cwd=tmp_path) as process:
        output, errors = process.communicate(timeout=120)
    assert (process.returncode, output.strip(), errors) == (0, "GL_NO_ERROR", "")


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [(["gone.tif"], 1, "gone.tif"), (["nothing"], 1, "bundled"), (["--backend", "osmesa"], 2, "egl")],
)
def test_what_cannot_be_viewed_is_told_in_a_line(screen, tmp_path, arguments, status, words):
    with running(screen, "-m", "terrain_gl", "view", *arguments, cwd=tmp_path) as process:
        output, errors = process.communicate(timeout=120)
    assert (process.returncode, output, len(errors.splitlines())) == (status, "", 1) and words in errors


def test_without_a_display():
    environment = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}
    command = [sys.executable, "-m", "terrain_gl", "view", "canyon"]
    result = subprocess.run(command, env=environment, text=True, capture_output=True)
    assert (result.returncode, result.stdout, len(result.stderr.splitlines())) == (1, "", 1)
    assert "display" in result.stderr and "terrain-gl shot" in result.stderr


def load(path):
    return read_image(path)[..., :3].astype(int)
