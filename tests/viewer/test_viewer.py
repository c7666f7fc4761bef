"""Frames of a viewer, without a window: at rest, in motion, and after any events."""

import numpy as np
import pytest
from viewers import changed, drawn_at_once, hills, later, light_is_up_to_date, seen, set_budget, settle, slow, swift

from terrain_gl.camera import Camera
from terrain_gl.error import ErrorTables
from terrain_gl.heightmap import Heightmap
from terrain_gl.image import write_image
from terrain_gl.renderer import Renderer
from terrain_gl.terrain import Terrain
from terrain_gl.viewer.commands import BY_KEY, press
from terrain_gl.viewer.frame_budget import COARSEST
from terrain_gl.viewer.loading import Opened


def test_the_first_picture_comes_quickly_then_the_full_one(empty):
    set_budget(empty, slow())
    heightmap = hills()
    empty.show(Renderer(heightmap, (320, 200), ctx=empty.ctx), Opened(heightmap, Camera.default(heightmap)))
    frames = 0
    while not empty.painter.has_picture:  # programs may have to be compiled: a line says how far it is
        assert empty.progress.text.startswith("drawing the first picture") and not empty.settled
        assert later(empty, 0.01)
        frames += 1
    assert frames > 2 and empty.painter.frame.way == COARSEST and empty.painter.frame.stats["width"] == 80
    assert empty.progress.text == "computing light and shadow"
    later(empty)
    shares = []
    while empty.painter.light.share is not None:  # until there is light
        shares.append(empty.painter.light.share)
        assert empty.busy and empty.painter.frame.way == COARSEST
        later(empty, 0.01)
    assert len(shares) > 5 and shares == sorted(shares)
    frames = 0
    while empty.painter.frame.way == COARSEST:  # the full picture comes in portions; between them come events
        assert empty.busy and empty.painter.has_picture
        later(empty, 0.3)
        frames += 1
    assert frames > 5 and empty.painter.frame.stats["width"] == 320
    settle(empty)


def test_a_full_picture_in_steps_is_the_same(viewer):
    viewer.settings.panel = False
    set_budget(viewer, slow())
    settle(viewer)
    drawn, pose = seen(viewer), viewer.scene.controller.pose
    viewer.painter.forget()
    assert not later(viewer) and viewer.busy and viewer.progress is None  # there is nothing new to see yet
    assert later(viewer) and viewer.progress.text == "drawing in full size"  # it takes longer than a second
    viewer.scene.controller.look(30, 0)
    assert later(viewer)  # a motion comes between
    viewer.scene.controller.pose = pose
    settle(viewer)
    assert np.array_equal(seen(viewer), drawn)
    assert np.array_equal(drawn_at_once(viewer), drawn)


def test_a_window_of_no_size_does_nothing(viewer, folder):
    settle(viewer)
    size, before = viewer.window.size, viewer.scene.renderer.heightmap.heights.copy()
    viewer.mouse.press("left", 160, 150)
    viewer.window.resize((0, 0))
    viewer.mouse.release("left", 160, 150)
    viewer.mouse.press("left", 160, 150)
    for key in BY_KEY:
        if key not in ("escape", "ctrl+q"):
            press(viewer, key)
            later(viewer)
    viewer.mouse.release("left", 160, 150)
    viewer.window.resize(size)
    settle(viewer)
    assert np.array_equal(viewer.scene.renderer.heightmap.heights, before) and viewer.painter.frame.measured_px
    assert not list(folder.iterdir())
    press(viewer, "b")
    settle(viewer)
    viewer.mouse.press("left", 160, 150)
    later(viewer)
    viewer.window.resize((0, 0))
    viewer.mouse.release("left", 0, 0)
    viewer.window.resize(size)
    settle(viewer)
    assert viewer.sculpting.tool.strokes == (1, 0) and light_is_up_to_date(viewer)
    viewer.window.resize((0, 0))
    for _ in range(4):  # the brush; "Esc again"; what is sculpted is not saved
        assert not viewer.window.closing
        press(viewer, "escape")
    assert viewer.window.closing


@pytest.mark.slow
def test_keys_do_what_they_say(viewer, folder, monkeypatch):
    viewer.window.resize((80, 50))  # there are many of them
    for name in ("TURN_S", "DAY_S"):
        monkeypatch.setattr(f"terrain_gl.viewer.loops.{name}", 0.2)  # seconds of a film
    settle(viewer)
    for key in BY_KEY:
        if key not in ("escape", "ctrl+q", "p", "r", "ctrl+s", "ctrl+o", "shift+r"):
            press(viewer, key)
            settle(viewer)
    assert set(viewer.scene.bookmarks) == set(range(1, 10))
    press(viewer, "nonsense")
    viewer.settings.help = 1
    press(viewer, "escape")
    assert not viewer.settings.help and not viewer.window.closing
    for _ in range(3):  # the brush, the glass, the split: each is put away
        assert not viewer.window.closing
        press(viewer, "escape")
    assert not (viewer.sculpting.brushing or viewer.settings.lens)
    for _ in range(4):
        press(viewer, "escape")
    assert viewer.window.closing and not viewer.settings.split


def test_at_rest_it_measures_and_draws_no_more(viewer):
    settle(viewer)
    measured = dict(viewer.painter.frame.measured_px)
    stats = viewer.scene.renderer.measure()
    assert measured == pytest.approx({"max": stats["max_error_px"], "rms": stats["rms_error_px"]}, rel=1e-9)
    assert measured["max"] <= stats["certified_max_error_px"] <= 1.0
    assert not later(viewer, 1000.0)


def test_motion_is_drawn_and_ends_in_a_full_frame(viewer):
    viewer.settings.panel = False
    settle(viewer)
    before = seen(viewer)
    set_budget(viewer, slow())
    for key in ("w", "shift"):
        viewer.scene.controller.press(key)
    assert later(viewer) and viewer.painter.frame.way == COARSEST and viewer.scene.renderer.size == (80, 50)
    assert later(viewer, 0.1) and viewer.painter.frame.fps
    assert viewer.painter.frame.measured_px is None
    small = viewer.scene.renderer.inspector.frame
    assert small.options.max_error_px == COARSEST.looser * viewer.scene.frame_spec().sides[0].max_error_px
    bound_px = COARSEST.shrink * small.stats["certified_max_error_px"]  # in pixels of the window
    assert viewer.painter.frame.stats["certified_max_error_px"] == bound_px > 0
    viewer.scene.controller.let_go("w")
    settle(viewer)
    assert (
        viewer.scene.renderer.size == (320, 200)
        and viewer.painter.frame.measured_px
        and viewer.painter.frame.fps is None
    )
    arrived = seen(viewer)
    assert not np.array_equal(arrived, before) and np.array_equal(arrived, drawn_at_once(viewer))


def test_messages_come_and_go(viewer):
    settle(viewer)
    viewer.window.say("hello")
    assert later(viewer) and viewer.window.message == "hello"
    assert later(viewer, 100.0) and viewer.window.message == ""


def test_a_minimised_window_draws_nothing_and_comes_back(viewer):
    settle(viewer)
    viewer.window.resize((0, 0))
    assert not later(viewer)
    viewer.window.resize((320, 200))
    assert later(viewer)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(8))
def test_after_random_events_tables_and_bound_hold(viewer, seed, folder):
    """Random keys, strokes, sizes and frames in any order; each frame does one step of any work."""
    rng = np.random.default_rng(seed)
    settle(viewer)
    set_budget(viewer, slow())
    keys = [key for key in BY_KEY if key not in ("ctrl+s", "r", "p", "o")]
    does = {
        "frame": lambda: later(viewer, rng.choice([0.01, 0.05, 0.3, 1.0])),
        "key": lambda: press(viewer, rng.choice(keys)),
        "sculpt": lambda: press(viewer, rng.choice(["b", "ctrl+z", "ctrl+shift+z", "escape", "x"])),
        "press": lambda: viewer.mouse.press(rng.choice(["left", "right"]), *rng.uniform((0, 60), (320, 200))),
        "point": lambda: viewer.mouse.move(*rng.uniform((0, 40), (320, 200))),
        "let go": lambda: viewer.mouse.release(rng.choice(["left", "right"]), *rng.uniform((0, 60), (320, 200))),
        "raise": lambda: viewer.exaggerate(rng.choice([0.5, 1.0, 2.0])),
        "size": lambda: viewer.window.resize(((320, 200), (0, 0), (1, 1), (160, 120))[rng.integers(4)]),
    }
    often = np.array([45, 6, 12, 12, 10, 11, 2, 2])
    for name in rng.choice(list(does), 100, p=often / often.sum()):
        does[name]()
        viewer.window.closing = False
    viewer.window.resize((320, 200))
    set_budget(viewer, swift())
    for button in ("left", "right"):
        viewer.mouse.release(button, 160, 150)
    viewer.scene.controller.let_go_all()
    settle(viewer)
    renderer, measured = viewer.scene.renderer, viewer.painter.frame.measured_px
    assert light_is_up_to_date(viewer) and not viewer.sculpting.at_work
    if measured and viewer.painter.frame.certified_px is not None:
        assert measured[viewer.painter.frame.stats["certified_metric"]] <= viewer.painter.frame.certified_px
    rebuilt = Heightmap(renderer.heightmap.heights, renderer.heightmap.spacing_m)
    rebuilt.quantised_m = renderer.heightmap.quantised_m
    built = ErrorTables(Terrain(viewer.ctx, rebuilt))
    for name in ("nodes", "counters", "squares", "contributions"):
        assert getattr(built, name).read() == getattr(renderer.tables, name).read(), name
    built.terrain.release()
    built.release()


def test_sky_images_and_water(viewer, tmp_path):
    settle(viewer)
    sunny = seen(viewer)
    for path, words in (("gone.hdr", "gone.hdr"), (str(tmp_path), "")):
        viewer.images.read("sky", path)
        viewer.images.join()
        later(viewer)
        assert (
            words in viewer.window.message and "\n" not in viewer.window.message and viewer.settings.options.sky is None
        )
    red = np.zeros((16, 32, 3), "f4")
    red[..., 0] = 1.0
    write_image(tmp_path / "red.exr", red)
    viewer.images.read("sky", f" {tmp_path / 'red.exr'} ")
    settle(viewer)
    under_red = seen(viewer)
    assert viewer.settings.options.sky == str(tmp_path / "red.exr")
    assert (under_red[:, 200:, 0] > 4 * under_red[:, 200:, 1]).mean() > 0.9
    viewer.images.read("sky", "")
    settle(viewer)
    assert np.array_equal(seen(viewer)[:, 250:], sunny[:, 250:])
    viewer.settings.change_all(water_m=100.0)
    settle(viewer)
    assert changed(seen(viewer), sunny) > 0.1
