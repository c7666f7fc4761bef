"""Loading maps: in a thread, with a preview; cancelled and refused loads."""

import time

import numpy as np
import pytest
from viewers import hills, later, set_budget, settle, slow, swift, with_a_stroke

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.camera import Camera
from terrain_gl.heightmap import Heightmap
from terrain_gl.renderer.options import FrameOptions
from terrain_gl.viewer import map_section
from terrain_gl.viewer.commands import press
from terrain_gl.viewer.loading import PREVIEW_POSTS, Opened, file_opener, preview
from terrain_gl.viewer.settings import Settings
from terrain_gl.viewer.viewer import Viewer


@pytest.mark.slow
def test_a_large_map_has_a_preview_while_its_tables_are_built(empty):
    n = 4 * PREVIEW_POSTS + 1
    heights = np.add.outer(np.sin(np.arange(n) / 40.0), np.cos(np.arange(n - 500) / 60.0)) * 200
    heightmap = Heightmap(heights, (10.0, 12.0), "large")
    few = preview(heightmap)
    assert max(few.heights.shape) == PREVIEW_POSTS and np.allclose(few.extent_m, heightmap.extent_m)
    assert few.heights[-1, -1] == heightmap.heights[-1, -1] and preview(hills()) is None
    set_budget(empty, slow())
    empty.loader.load("large", lambda progress: Opened(heightmap, Camera.default(heightmap), key="large"))
    empty.loader.job.join()
    pictures = []
    while empty.loader.job:
        later(empty)
        pictures.append(empty.scene.has_map and empty.scene.renderer.heightmap)
    first = next(picture for picture in pictures if picture)
    assert first.rows == PREVIEW_POSTS and pictures.count(first) > 3
    assert empty.scene.renderer.heightmap is heightmap and empty.scene.controller.heightmap is heightmap
    empty.scene.controller.look(50, 0)
    set_budget(empty, swift())
    settle(empty)
    assert empty.painter.frame.measured_px["max"] <= 1


def test_a_map_that_had_a_preview_has_the_exaggeration_that_was_asked_for(empty):
    n = 4 * PREVIEW_POSTS + 1
    heightmap = Heightmap(np.add.outer(np.sin(np.arange(60) / 9.0), np.cos(np.arange(n) / 60.0)) * 20, 10.0, "long")
    empty.settings.change_all(style="lambert", exaggeration=2.0)
    opened = Opened(heightmap, Camera.default(heightmap), key="long")
    set_budget(empty, slow())
    empty.loader.load("long", lambda progress: opened)
    empty.loader.job.join()
    while not empty.scene.has_map:
        later(empty)
    assert empty.scene.is_preview and empty.scene.frame_spec().sides[0].exaggeration == 2
    set_budget(empty, swift())
    settle(empty)
    assert not empty.scene.is_preview and empty.scene.frame_spec().sides[0].exaggeration == 2
    assert empty.scene.controller.eye[2] == pytest.approx(2 * opened.camera.eye[2])
    assert empty.scene.frame_spec().camera.eye[2] == pytest.approx(opened.camera.eye[2])
    empty.loader.load("other", lambda progress: Opened(hills(), Camera.default(hills()), key="other"))
    settle(empty)
    assert empty.scene.exaggeration == 1


def test_the_window_says_how_a_file_was_understood(viewer, tmp_path):
    heights = hills().heights.copy()
    heights[5:9, 5:9] = -9999
    np.save(tmp_path / "gaps.npy", heights)
    viewer.loader.load("gaps.npy", file_opener(str(tmp_path / "gaps.npy")))
    while viewer.loader.job:
        later(viewer)
    assert "16 posts have exactly -9999" in viewer.window.message
    assert "gives no distance between its posts" in viewer.window.message


def test_frozen_levels_end_with_their_map(viewer):
    settle(viewer)
    press(viewer, "l")
    settle(viewer)
    assert viewer.scene.frozen
    viewer.loader.load("other", lambda progress: Opened(hills(), Camera.default(hills()), key="other"))
    settle(viewer)
    assert viewer.scene.opened.key == "other" and viewer.scene.frozen is None


def test_a_file_is_loaded_beside_the_map_that_is_seen(viewer, tmp_path):
    settle(viewer)
    before = viewer.scene.renderer
    np.save(tmp_path / "slope.npy", np.add.outer(np.arange(40.0), np.arange(30.0)))
    set_budget(viewer, slow())
    viewer.loader.load("slope.npy", file_opener(str(tmp_path / "slope.npy")))
    later(viewer)
    assert viewer.scene.renderer is before and "slope.npy" in viewer.loader.job.text
    assert "slope.npy" in viewer.progress.text and viewer.progress.can_cancel
    settle(viewer)
    assert viewer.scene.renderer.heightmap.cols == 30 and viewer.painter.frame.posts == (30, 40)


@pytest.mark.parametrize("content", [b"", b"no map", b"\x89PNG\r\n\x1a\n damaged"])
def test_a_broken_file_gives_one_line_and_the_map_stays(viewer, tmp_path, content):
    settle(viewer)
    before = viewer.scene.renderer
    (tmp_path / "broken.png").write_bytes(content)
    viewer.loader.load("broken.png", file_opener(str(tmp_path / "broken.png")))
    settle(viewer)
    assert viewer.scene.renderer is before and viewer.loader.job is None
    viewer.loader.load("gone.tif", file_opener(str(tmp_path / "gone.tif")))
    viewer.loader.job.join()
    later(viewer)
    assert not viewer.loader.job and "gone.tif" in viewer.window.message and "\n" not in viewer.window.message


def test_loading_is_cancelled(viewer):
    settle(viewer)
    before, heightmap = viewer.scene.renderer, Heightmap(np.zeros((800, 900)), 1.0)
    told = []

    def slowly(progress):
        for part in range(10000):
            told.append(part)
            progress(part / 10000)
            time.sleep(0.01)

    viewer.loader.load("endless", slowly)
    job = viewer.loader.job
    press(viewer, "escape")
    assert not viewer.loader.job and not viewer.window.closing
    job.join()
    assert len(told) < 1000  # of 10,000, each of which takes 10 ms
    set_budget(viewer, slow())
    viewer.loader.load("zeros", lambda progress: Opened(heightmap, Camera.default(heightmap)))
    viewer.loader.job.join()
    while viewer.loader.job.progress == 0:
        later(viewer)
    press(viewer, "escape")
    settle(viewer)
    assert viewer.scene.renderer is before


def test_a_first_map_that_fails_ends_the_run(empty):
    def failing(progress):
        raise TerrainError("broken.tif: is broken")

    empty.loader.load("broken.tif", failing)
    empty.loader.job.join()
    with pytest.raises(TerrainError, match="is broken"):
        later(empty)


def test_a_viewer_closes_while_a_map_loads(ctx, target):
    heightmap, framebuffer = Heightmap(np.zeros((1000, 900)), 1.0), target((32, 20))
    for frames in (1, 3, 6):
        viewer = Viewer(ctx, framebuffer, (32, 20), Settings(), budget=slow())
        viewer.loader.load("zeros", lambda progress: Opened(heightmap, Camera.default(heightmap)))
        viewer.loader.job.join()
        for _ in range(frames):
            later(viewer)
        assert viewer.loader.job
        viewer.close()


def test_an_assumed_spacing_is_said_and_can_be_set(empty, tmp_path):
    said, say = [], empty.window.say
    empty.window.say = lambda text, *seconds: (said.append(text), say(text, *seconds))
    np.save(tmp_path / "plain.npy", hills().heights)
    empty.open(str(tmp_path / "plain.npy"))
    settle(empty)
    assert "1 m is assumed" in said.pop() and empty.scene.renderer.heightmap.spacing_m == (1.0, 1.0)
    map_section._set_spacing(empty, "30")
    settle(empty)
    assert empty.scene.renderer.heightmap.spacing_m == (30.0, 30.0) and empty.painter.frame.measured_px["max"] <= 1
    assert not said
    for words in ("x", "-3", "nan"):
        map_section._set_spacing(empty, words)
        settle(empty)
        assert "spacing" in said.pop() and empty.scene.renderer.heightmap.spacing_m == (30.0, 30.0)


def test_undone_strokes_are_not_unsaved_land(viewer, folder):
    with_a_stroke(viewer)
    assert viewer.sculpting.unsaved
    press(viewer, "ctrl+z")
    assert not viewer.sculpting.unsaved and viewer.sculpting.may_leave()
    press(viewer, "ctrl+shift+z")
    assert viewer.sculpting.unsaved
    viewer.sculpting.save("land.tif")
    viewer.sculpting.join()
    later(viewer)
    assert not viewer.sculpting.unsaved
    press(viewer, "ctrl+z")
    assert viewer.sculpting.unsaved and not viewer.sculpting.may_leave()  # the file has the stroke
    press(viewer, "ctrl+y")
    assert not viewer.sculpting.unsaved
    viewer.exaggerate(2.0)
    settle(viewer)
    assert not viewer.sculpting.unsaved


def test_edits_are_not_lost_without_a_warning(viewer, folder):
    with_a_stroke(viewer)
    press(viewer, "escape")
    press(viewer, "ctrl+q")
    assert not viewer.window.closing and "not saved" in viewer.window.message
    viewer.open("alpine-30m")  # asked again
    assert viewer.loader.job
    viewer.loader.cancel()
    press(viewer, "b")
    settle(viewer)
    viewer.mouse.press("left", 160, 150)
    viewer.sculpting.save("land.tif")
    assert "brush is still at work" in viewer.window.message
    viewer.mouse.release("left", 160, 150)
    settle(viewer)
    viewer.open("alpine-30m")
    assert not viewer.loader.job and "not saved" in viewer.window.message
    press(viewer, "ctrl+s")
    viewer.sculpting.save(viewer.sculpting.save_as)
    viewer.sculpting.join()
    later(viewer)
    assert str(folder) in viewer.window.message and not viewer.sculpting.unsaved
    press(viewer, "escape")
    press(viewer, "ctrl+q")
    assert viewer.window.closing


@pytest.mark.slow
def test_size_and_heights_are_set(empty, tmp_path):
    heights = hills().heights
    np.save(tmp_path / "plain.npy", heights)
    empty.open(str(tmp_path / "plain.npy"))
    settle(empty)
    empty.exaggerate(2.0)
    settle(empty)
    map_section._set_size(empty, "2.56 × 5.12 km")
    settle(empty)
    assert empty.scene.heightmap.spacing_m == (20.0, 40.0) and empty.scene.exaggeration == 2.0
    map_section._set_heights(empty, "-100 to 1100")
    settle(empty)
    now, low = empty.scene.heightmap, heights.min()
    factor = 1200.0 / np.ptp(heights)
    assert now.spacing_m == (20.0, 40.0) and now.range_m == pytest.approx((-100.0, 1100.0), abs=1e-3)
    assert np.allclose(now.heights, factor * (heights - low) - 100.0, atol=1e-3)
    again = Heightmap.open(**now.opened)  # a command line names the same land
    assert np.array_equal(again.heights, now.heights) and again.spacing_m == now.spacing_m
    assert empty.painter.frame.measured_px["max"] <= 1
    for set_, words in ((map_section._set_size, ("", "-3", "1 2 3")), (map_section._set_heights, ("5", "9 2", "a b"))):
        for typed in words:
            empty.window.message = ""
            set_(empty, typed)
            assert "expected metres" in empty.window.message and not empty.loader.job


def test_numbers_as_users_type_them():
    assert map_section.numbers("812 to 2431") == [812.0, 2431.0] and map_section.numbers("-28.5 .. 1e3") == [
        -28.5,
        1000,
    ]
    assert map_section.numbers("5.1 x 6 km") == [5100.0, 6000.0] and map_section.numbers("none") == []


@pytest.mark.slow
def test_the_look_is_remembered_for_each_map(empty, tmp_path):
    for name in ("one", "two"):
        np.save(tmp_path / f"{name}.npy", hills().heights)
    seen = []
    for name, look in (("one", "green"), ("two", None), ("one", None)):
        empty.open(str(tmp_path / f"{name}.npy"))
        settle(empty)
        seen.append(empty.settings.options.look)
        empty.settings.change_all(look=look or seen[-1])
    assert seen == ["auto", "auto", "green"]


@pytest.mark.slow
def test_a_look_that_was_asked_for_holds_for_the_first_map(ctx, target, tmp_path):
    np.save(tmp_path / "one.npy", hills().heights)
    viewer = Viewer(ctx, target((32, 20)), (32, 20), Settings([FrameOptions(look="tint")]), budget=swift())
    viewer.open(str(tmp_path / "one.npy"))
    settle(viewer)
    assert viewer.settings.options.look == "tint"
    viewer.close()
