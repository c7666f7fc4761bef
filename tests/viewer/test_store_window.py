"""A store in the window: it is flown over while tiles come; what a store cannot do is told in one line."""

import math
import threading
import time
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rasters import spaced, write_raster
from test_streaming import Slow
from viewers import Ticking, later, seen, set_budget, settle, swift, texts

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.camera import Camera
from terrain_gl.cli.line import command_line
from terrain_gl.files import maps
from terrain_gl.files.edits import read_edits
from terrain_gl.files.views import standard_view
from terrain_gl.heightmap import Heightmap
from terrain_gl.mesh import vertex_heights
from terrain_gl.pages.edited_map import EditedMap
from terrain_gl.readers import Reading
from terrain_gl.renderer import Renderer
from terrain_gl.renderer.options import FrameOptions
from terrain_gl.viewer import map_section, painter, tile_map
from terrain_gl.viewer.app import App
from terrain_gl.viewer.frame_budget import FrameBudget
from terrain_gl.viewer.legend import VIRIDIS
from terrain_gl.viewer.loading import Opened, file_opener
from terrain_gl.viewer.settings import Settings

pytest.importorskip("zarr")
from terrain_gl.store import cache
from terrain_gl.store.opened import StoredMap

SIZE = (360, 640)
VERTEX = np.dtype([("at", "<f8", 3), ("normal", "<f4", 3), ("texture", "<f4", 2)])  # of a PLY file
FACE = np.dtype([("count", "u1"), ("corners", "<u4", 3)])


@contextmanager
def app_alone(session_context, style="lambert"):
    """An app without a map, in a context of its own."""
    from terrain_gl.gpu.context import create_context

    with create_context("egl") as ctx:
        framebuffer = ctx.framebuffer([ctx.texture(SIZE, 4)])
        app = App(ctx, framebuffer, SIZE, Settings([FrameOptions(1.0, style=style)]), budget=swift())
        yield app
        app.close()
    session_context.__enter__()


@pytest.fixture
def shown(hills, session_context, request):
    """An app that shows a store, of which only the coarsest tiles are there."""
    with app_alone(session_context, getattr(request, "param", "lambert")) as app:
        stored = Slow(hills[1])
        opened = Opened(stored, standard_view(stored.coarse()), key="s")
        app.viewer.loader.load("s", lambda progress: opened)
        app.viewer.loader.job.join()
        while not app.viewer.painter.frame.stats:
            later(app)
        yield app, stored
        stored.gate.set()


def until_complete(app):
    end = time.monotonic() + 100
    while not app.viewer.settled:
        assert time.monotonic() < end
        time.sleep(0.005)
        later(app)


@pytest.mark.slow
@pytest.mark.parametrize("shown", ["shaded"], indirect=True)
def test_a_store_is_shown_at_once_and_fills_in(shown):
    app, stored = shown
    later(app)
    stats = app.viewer.painter.frame.stats
    assert not stats["complete"] and app.viewer.progress.text.startswith("loading: ")
    assert "missing tiles: " in texts(app) and not app.viewer.settled
    coarse = seen(app)
    stored.gate.set()
    until_complete(app)
    stats = app.viewer.painter.frame.stats
    assert stats["complete"] and stats["certified_max_error_px"] <= 1.0
    assert app.viewer.progress is None and app.viewer.tiles.note == ""
    assert app.viewer.scene.renderer.picture.lighting.missing == 0
    words = texts(app)
    assert "all tiles loaded" in words and "achieved" not in words
    assert np.abs(seen(app) - coarse).max() > 20


@pytest.mark.slow
def test_the_panel_has_a_map_of_the_loaded_tiles(shown):
    app, stored = shown
    top = app.viewer.scene.renderer.terrain.top_level
    coarsest = 255 * np.array(tile_map.colour_of(top, top))

    def share():
        """Share of the panel's map of tiles that has the colour of the coarsest level."""
        later(app)
        later(app)
        left, first, right, end = (round(side) for side in app.gui.widgets.places["tiles"])
        inside = seen(app)[first + 1 : end - 1, left + 1 : right - 1]
        return np.mean(np.abs(inside - coarsest).max(-1) < 12)

    assert "Tiles that are loaded" in texts(app) and share() > 0.9
    stored.gate.set()
    until_complete(app)
    app.viewer.window.refresh()
    assert share() < 0.5


def test_levels_of_a_map_of_tiles():
    levels = np.random.default_rng(2).integers(0, 5, (23, 50))
    few = tile_map.finest_levels(levels, 10)
    assert few.shape == (5, 10)
    for (row, col), level in np.ndenumerate(few):
        assert level == levels[5 * row : 5 * row + 5, 5 * col : 5 * col + 5].min()
    np.testing.assert_array_equal(tile_map.finest_levels(levels), levels)
    painted = np.full(levels.shape, -1)
    for row, first, end, level in tile_map.runs(levels):
        assert (painted[row, first:end] == -1).all() and (end == 50 or levels[row, end] != level)
        painted[row, first:end] = level
    np.testing.assert_array_equal(painted, levels)
    ends = (tile_map.colour_of(level, 8) for level in (0, 2, 8))
    np.testing.assert_allclose(list(ends), [VIRIDIS[0], VIRIDIS[1], VIRIDIS[-1]])


def test_it_is_flown_over_while_nothing_comes(shown):
    app, _ = shown
    controller, before = app.viewer.scene.controller, app.viewer.scene.controller.camera
    app.key_down("w", "w")
    for _ in range(5):
        later(app, 0.1)
    app.key_up("w")
    assert controller.camera != before and np.isfinite(controller.height_above_ground_m)
    assert app.viewer.pointer.place_under(240, 200) is not None
    assert not app.viewer.painter.frame.stats["complete"]


@pytest.mark.slow
@pytest.mark.parametrize("shown", ["shaded"], indirect=True)
def test_what_a_store_cannot_do_is_told(shown, folder):
    app, stored = shown
    stored.gate.set()
    until_complete(app)
    viewer = app.viewer

    def said(action):
        viewer.window.message = ""
        action()
        return viewer.window.message

    assert "method sat" in said(lambda: app.press("f"))
    assert "keeps its size and its heights" in said(lambda: map_section._set_spacing(viewer, "3"))
    copied = []
    viewer.saver.line_of, viewer.saver.on_copy = command_line, copied.append
    assert "copied" in said(lambda: app.press("y"))
    assert copied[0].startswith(f"terrain-gl shot {stored.name} ") and "--style" not in copied[0]
    viewer.settings.change(triangles=1000, style="error", method="clipmap")
    spec = viewer.scene.frame_spec().sides[0]
    assert (spec.method, spec.triangles, spec.style) == ("sat", 1000, "error")
    until_complete(app)
    stats = viewer.painter.frame.stats
    assert stats["complete"] and 800 < stats["triangles"] <= 1000


def test_the_mesh_of_a_store_is_saved_as_that_of_the_map_in_memory(shown, hills, folder):
    """Also while its tiles are still missing in the window: it waits for them."""
    app, stored = shown
    viewer = app.viewer
    viewer.saver.mesh_format = ".ply"
    few = viewer.painter.frame.stats["triangles"]
    stored.gate.set()
    app.press("o")
    assert not viewer.scene.renderer.streaming.waits
    viewer.saver.join()
    spec = viewer.scene.frame_spec()
    with Renderer(hills[0], spec.size) as whole:
        told = whole.choose(spec.camera, **vars(spec.sides[0]))
        corners = whole.triangles().astype(float)
    count = told["triangles"]
    assert count > 1.5 * few and f"{count:,} triangles in metres" in viewer.window.message
    head, _, body = (folder / "s-001.ply").read_bytes().partition(b"end_header\n")
    vertices = np.frombuffer(body, VERTEX, int(head.split(b"element vertex ")[1].split()[0]))["at"]
    faces = np.frombuffer(body[VERTEX.itemsize * len(vertices) :], FACE, count)["corners"]
    heights = vertex_heights(hills[0].heights, corners)
    col, row = np.moveaxis(corners, -1, 0)
    expected = np.stack([2 * col, 2 * (hills[0].rows - 1 - row), heights], -1)
    np.testing.assert_allclose(in_order(vertices[faces]), in_order(expected), atol=1e-4)  # float32 heights to 100 m


def in_order(triangles):
    """Triangles (n, 3, 3), sorted by the sums of their corners."""
    sums = triangles.sum(1)
    return triangles[np.lexsort(np.round(sums, 2).T)]


def test_heights_of_a_saved_mesh_stay_when_the_camera_flies_on(hills):
    with Renderer(StoredMap(hills[1]), (160, 90)) as renderer:
        renderer.choose(standard_view(hills[0], "valley"), 0.5)
        heights = renderer.inspector.drawn_heights()
        kept = heights[:, :]
        pool = renderer.terrain
        pool.hide()
        assert np.abs(pool.filled[:, :] - kept).max() > 0.1
        pool.filled.copies[:] = 0.0
        np.testing.assert_array_equal(heights[:, :], kept)


@pytest.mark.slow
def test_a_store_is_exaggerated_at_once(shown, hills, folder):
    app, stored = shown
    viewer = app.viewer
    scene, controller = viewer.scene, viewer.scene.controller
    stored.gate.set()
    viewer.settings.change_all(water_m=0.0)
    until_complete(app)
    before = seen(app), controller.eye[2], viewer.pointer.place_under(240, 200)
    viewer.exaggerate(2.0)
    until_complete(app)
    assert viewer.loader.job is None and scene.exaggeration == 2 and np.abs(seen(app) - before[0]).max() > 20
    assert scene.controller.eye[2] == pytest.approx(2 * before[1]) and scene.controller.height_above_ground_m > 0
    spec = scene.frame_spec()
    assert spec.camera.eye[2] == pytest.approx(before[1]) and spec.sides[0].exaggeration == 2
    places = scene.renderer.picture.places()[0]
    for x, y in on_land(places, 5):  # what the cursor points at is what the pixel shows
        place = viewer.pointer.place_under(x, y)
        drawn = places[y, x]
        assert (place[0] / 2, 199 - place[1] / 2) == pytest.approx(drawn, abs=1.5)
        truth = scene.renderer.height_at(place[0], place[1])
        assert place[2] == pytest.approx(truth, abs=1.0) and scene.heightmap.range_m[1] == hills[0].range_m[1]
    viewer.settings.change_all(water_m=10.0)
    viewer.saver.line_of = command_line
    app.press("y")
    assert "--exaggeration 2" in viewer.window.message and "--water 10" in viewer.window.message
    viewer.saver.mesh_format = ".obj"
    app.press("o")
    viewer.saver.join()
    lines = (folder / "s-001.obj").read_text().splitlines()
    x, y, z = np.array([line.split()[1:4] for line in lines if line.startswith("v ")], float).T
    whole = (x % 2 == 0) & (y % 2 == 0)  # vertices on posts
    truth = 2 * hills[0].heights[199 - (y[whole] / 2).astype(int), (x[whole] / 2).astype(int)]
    np.testing.assert_allclose(z[whole], truth, atol=1e-3)
    viewer.exaggerate(1.0)
    viewer.settings.change_all(water_m=0.0)
    viewer.window.message = ""
    until_complete(app)
    assert scene.controller.eye[2] == pytest.approx(before[1]) and scene.frame_spec().sides[0].exaggeration == 1
    np.testing.assert_allclose(viewer.pointer.place_under(240, 200), before[2], atol=2.0)  # a post: other tiles


def on_land(places, count):
    """Some pixels, column and row, that see land, from the furthest to the nearest."""
    rows, cols = np.nonzero(places[..., 0] >= 0)
    return [(cols[i], rows[i]) for i in np.linspace(0.2 * len(rows), 0.9 * len(rows), count).astype(int)]


@pytest.mark.slow
def test_lines_lie_on_the_exaggerated_land_of_a_store(shown):
    app, stored = shown
    viewer = app.viewer
    stored.gate.set()
    viewer.settings.panel = False
    viewer.settings.change_all(wires=False)
    viewer.exaggerate(2.0)
    until_complete(app)
    bare = seen(app)
    x, y = on_land(viewer.scene.renderer.picture.places()[0], 3)[1]
    viewer.explainer.explain(x, y)
    place, patch = viewer.explainer.place, viewer.explainer.explanation
    assert all(
        0 <= at - first <= patch.side
        for at, first in zip((place[0] / 2, 199 - place[1] / 2), patch.corner, strict=True)
    )
    later(app)
    orange = (np.abs(seen(app) - [255, 120, 90]).max(-1) < 30) & (np.abs(seen(app) - bare).max(-1) > 30)
    assert orange.sum() > 20


@pytest.mark.slow
def test_the_summed_area_table_of_a_tile_gives_the_mean_of_a_box(shown):
    app, stored = shown
    viewer = app.viewer
    viewer.settings.panel = False
    app.press("u")
    viewer.settings.box = 6
    levels = set()
    for i in range(12):
        if i == 3:  # until now, only the coarsest tiles are there
            stored.gate.set()
            until_complete(app)
        x, y = on_land(viewer.scene.renderer.picture.places()[0], 12)[i]
        viewer.mouse.move(x, y)
        later(app)
        box = viewer.explainer.box
        level = box.table.level
        (col, row), (across, down) = box.on_map
        post = viewer.pointer.place_under(x, y)[:2] / 2
        assert col - (1 << level) < post[0] < col + across + (1 << level)
        assert row - (1 << level) < 199 - post[1] < row + down + (1 << level)
        at = (slice(start >> level, (start + length >> level) + 1) for start, length in ((row, down), (col, across)))
        assert box.mean_m == pytest.approx(stored.lattice_heights(level, *at).mean(), abs=1e-3)  # steps of 0.9 mm
        levels.add(level)
    assert len(levels) > 1 and "of the tile under the cursor" in texts(app)
    left, bottom, width, height = viewer.sums_frame
    picture = seen(app)[640 - bottom - height : 640 - bottom, left : left + width]
    assert np.abs(picture - [115, 242, 140]).max(-1).min() < 5  # the corners that add


@pytest.mark.slow
def test_a_split_picture_of_a_store_compares_two_metrics(shown):
    app, stored = shown
    viewer = app.viewer
    stored.gate.set()
    until_complete(app)
    before = viewer.settings.options
    app.press("t")
    assert "least squares, and the smallest largest error" in viewer.window.message
    until_complete(app)
    sides, stats = viewer.scene.frame_spec().sides, viewer.painter.side_stats
    assert [side.metric for side in sides] == ["rms", "max"] and {side.style for side in sides} == {"error"}
    assert len(stats) == 2 and all(each["complete"] for each in stats) and viewer.tiles.note == ""
    most = sides[0].triangles
    assert all(0.85 * most < each["triangles"] <= most for each in stats)
    assert stats[0]["certified_max_error_px"] > stats[1]["certified_max_error_px"]
    app.press("t")
    assert viewer.settings.sides == [before]


@pytest.mark.slow
def test_a_store_is_sculpted_and_its_edits_are_saved(shown, hills, folder):
    app, stored = shown
    app.viewer.settings.change(style="lambert")  # light is slow, and test_edited_store.py looks at it
    stored.gate.set()
    until_complete(app)
    viewer, before = app.viewer, seen(app)
    app.panels.opened["Sculpt"] = True

    def heights():
        return viewer.scene.heightmap.part(slice(0, 200), slice(0, 261)).copy()

    app.press("b")
    until_complete(app)
    viewer.sculpting.tool.strength_m = 20.0
    viewer.mouse.press("left", 240, 200)
    later(app)
    stats = viewer.painter.frame.stats
    assert stats["tiles_wide"] > 0 and "Bounds are wider" in texts(app) and viewer.title.endswith("*")
    viewer.mouse.release("left", 240, 200)
    until_complete(app)
    stats, after = viewer.painter.frame.stats, heights()
    assert stats["tiles_wide"] == 0 and stats["complete"] and "Bounds are wider" not in texts(app)
    assert (after - hills[0].heights).max() > 10 and np.abs(seen(app) - before).max() > 20
    viewer.saver.line_of = command_line
    app.press("y")
    assert "in no file" in viewer.window.message
    viewer.quit()
    assert not viewer.window.closing and "not saved" in viewer.window.message
    app.press("ctrl+s")
    assert viewer.sculpting.save_as == "s-edited-1.npz" and "name.npz" in texts(app)
    viewer.sculpting.save("edits.npz")
    viewer.sculpting.join()
    later(app)
    assert "--edits edits.npz" in viewer.window.message and not viewer.sculpting.unsaved
    app.press("y")
    assert "--edits" in viewer.window.message
    edited = EditedMap(StoredMap(hills[1]))
    for x, y, patch in read_edits("edits.npz", edited):
        edited.write(x, y, patch)
    np.testing.assert_array_equal(edited.part(slice(0, 200), slice(0, 261)), after)
    app.press("ctrl+z")
    until_complete(app)
    np.testing.assert_array_equal(heights(), hills[0].heights)
    assert viewer.sculpting.unsaved  # the file has the stroke
    app.press("ctrl+shift+z")
    until_complete(app)
    np.testing.assert_array_equal(heights(), after)


@pytest.mark.slow
def test_the_edits_of_an_exaggerated_store_are_where_the_cursor_was(shown, hills, folder):
    app, stored = shown
    viewer = app.viewer
    stored.gate.set()
    viewer.exaggerate(2.0)
    until_complete(app)
    app.press("b")
    until_complete(app)
    viewer.sculpting.tool.strength_m = 20.0
    x, y = on_land(viewer.scene.renderer.picture.places()[0], 3)[1]
    place = viewer.pointer.place_under(x, y)
    viewer.mouse.press("left", x, y)
    later(app)
    viewer.mouse.release("left", x, y)
    until_complete(app)
    all_posts = slice(0, 200), slice(0, 261)
    risen = viewer.scene.renderer.heightmap.part(*all_posts) - hills[0].heights
    row, col = np.unravel_index(risen.argmax(), risen.shape)
    assert risen.max() > 10 and risen.min() >= 0 and np.hypot(2 * col - place[0], 2 * (199 - row) - place[1]) < 6
    assert viewer.scene.exaggeration == 2 and viewer.painter.frame.stats["complete"]
    viewer.sculpting.save("edits.npz")
    viewer.sculpting.join()
    edited = EditedMap(StoredMap(hills[1]))
    for first_x, first_y, patch in read_edits("edits.npz", edited):
        edited.write(first_x, first_y, patch)
    np.testing.assert_array_equal(edited.part(*all_posts) - hills[0].heights, risen)
    app.press("ctrl+z")
    until_complete(app)
    np.testing.assert_array_equal(viewer.scene.renderer.heightmap.part(*all_posts), hills[0].heights)


def test_a_brush_over_a_tile_that_cannot_be_read_says_so(shown, monkeypatch):
    app, stored = shown
    app.viewer.settings.change(style="lambert")  # light is slow, and test_edited_store.py looks at it
    stored.gate.set()
    until_complete(app)
    app.press("b")
    until_complete(app)

    def fail(*_):
        raise TerrainError("its checksum does not fit")

    monkeypatch.setattr(stored, "lattice_heights", fail)
    app.viewer.mouse.press("left", 240, 200)
    later(app)
    app.viewer.mouse.release("left", 240, 200)
    later(app)
    assert "checksum" in app.viewer.window.message and not app.viewer.sculpting.unsaved


@pytest.mark.slow
def test_patches_are_explained_and_pictures_wait_for_their_tiles(shown, folder):
    app, stored = shown
    stored.gate.set()
    until_complete(app)
    app.viewer.explainer.explain(240, 200)
    assert app.viewer.explainer.explanation.bound_px <= 1.0
    app.press("p")
    while app.viewer.saver.shot:
        later(app)
    app.viewer.saver.join()
    assert list(folder.glob("*.png")) and '"complete": true' in next(folder.glob("*.json")).read_text()
    assert not app.viewer.scene.renderer.streaming.waits


@pytest.mark.slow
def test_maps_and_stores_follow_each_other_in_a_window(shown, hills, tmp_path):
    app, stored = shown
    small = str(tmp_path / "hills.npy")
    np.save(small, hills[0].heights)
    stored.gate.set()
    until_complete(app)
    viewer = app.viewer
    for is_paged, name in ((False, small), (True, str(hills[1]))):
        viewer.open(name)
        viewer.loader.job.join()
        until_complete(app)
        assert viewer.scene.is_paged == is_paged and viewer.painter.frame.stats["certified_max_error_px"] <= 1
        assert Path(viewer.title).name == Path(name).name and app.errors == []


def test_a_dropped_store_is_opened_by_a_new_window(hills):
    opened = file_opener(str(hills[1]))(lambda share: None)
    assert isinstance(opened.heightmap, StoredMap) and isinstance(opened.camera, Camera)


# --- Huge rasters without a store -------------------------------------------------------------------------------------


@pytest.fixture
def raster(folder, monkeypatch):
    """A raster that counts as huge, of 400 × 300 posts."""
    y, x = np.mgrid[0:300, 0:400]
    write_raster(folder / "huge.tif", (x + 0.5 * y).astype("f4"), spaced(10, 0, 3000))
    monkeypatch.setattr("terrain_gl.basics.limits.MAX_SIDE", 350)
    monkeypatch.setattr(maps, "LONGEST", 100)
    return "huge.tif"


def test_a_huge_raster_is_sampled_and_a_store_is_offered(raster):
    few, offer = maps.sample(raster, Reading())
    assert few.heights.shape == (75, 100) and few.extent_m == pytest.approx((3990, 2990))
    assert few.range_m[0] < 5 and few.range_m[1] > 540
    assert "400 x 300 posts" in offer and "terrain-gl build huge.tif -o huge.zarr" in offer and "\n" not in offer


def test_the_window_shows_the_sample_and_says_so(raster, make_app):
    app = make_app(with_map=False)
    app.viewer.open(raster)
    settle(app)
    words = texts(app)
    assert "preview" in words and "terrain-gl build huge.tif" in words and "nothing certified" in words
    assert app.viewer.painter.frame.stats["certified_max_error_px"] is None
    app.press("p")
    assert "terrain-gl build" in app.viewer.window.message
    app.viewer.loader.load("m", lambda progress: Opened(*_map(), key="m"))  # another map takes its place
    settle(app)
    assert not app.viewer.scene.is_preview and app.viewer.tiles.note == ""


def _map():
    heightmap = Heightmap(np.add.outer(np.sin(np.arange(65.0) / 5), np.zeros(65)), 10.0, "m")
    return heightmap, Camera.default(heightmap)


@pytest.fixture
def large(raster, tmp_path, monkeypatch):
    """A raster that counts as large, its store still to be made when the gate opens."""
    gate = threading.Event()
    build = cache.build
    monkeypatch.setattr("terrain_gl.basics.limits.MAX_SIDE", 16385)
    monkeypatch.setattr(cache, "PAYS_POSTS", 5000)
    monkeypatch.setattr(cache, "_in_use", [])
    monkeypatch.setattr(cache, "build", lambda *told, **more: gate.wait(20) and build(*told, **more))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return raster, gate


def opener_of(run, monkeypatch, *words):
    """What the command `view` gives to the window."""
    seen = []
    monkeypatch.setattr("terrain_gl.viewer.run", lambda opener, **_: seen.append(opener) or {})
    assert run("view", *words)[0] == 0
    return seen[0]


@pytest.mark.slow
def test_a_large_raster_is_a_preview_until_its_store_is_made(large, session_context, run, monkeypatch):
    raster, gate = large
    opener = opener_of(run, monkeypatch, raster)
    with app_alone(session_context) as app:
        viewer = app.viewer
        viewer.loader.load(raster, opener)
        while not viewer.painter.frame.stats:
            later(app)
        assert viewer.scene.awaits_map and not viewer.scene.is_paged and viewer.scene.heightmap.cols == 100
        assert viewer.painter.frame.stats["certified_max_error_px"] is None
        words = texts(app)
        assert "preview: a coarse sample" in words and "making a store of huge.tif: 0%" in words
        viewer.scene.controller.pose = replace(viewer.scene.controller.pose, fov_deg=33.0)
        gate.set()
        viewer.loader.job.join()
        until_complete(app)
        scene = viewer.scene
        assert scene.is_paged and not scene.is_preview and scene.heightmap.cols == 400
        assert viewer.painter.frame.stats["certified_max_error_px"] <= 1 and scene.controller.camera.fov_deg == 33
        assert scene.controller.heightmap is scene.heightmap  # no longer the sample

        viewer.window.message = ""
        app.press("f")
        assert "Hold in memory, under Map" in viewer.window.message
        scene.opened = replace(scene.opened, camera_given=True)  # the view stays all the same
        viewer.hold_in_memory()
        viewer.loader.job.join()
        until_complete(app)
        assert not scene.is_paged and scene.heightmap.cols == 400 and scene.controller.camera.fov_deg == 33
        app.press("t")
        assert len(viewer.settings.sides) == 2 and app.errors == []


def test_options_that_a_store_lacks_hold_the_raster_in_memory(large, run, monkeypatch):
    raster, _ = large
    for words in (("--method", "full"), ("--no-cache",)):
        opened = opener_of(run, monkeypatch, raster, *words)(lambda share: None)
        assert not opened.heightmap.is_store and opened.rest is None and opened.heightmap.cols == 400


def test_other_commands_name_the_command_that_builds(raster, run):
    status, _, err = run("bench", raster)
    assert status == 1 and err.count("\n") == 1 and "terrain-gl build huge.tif -o huge.zarr" in err


@pytest.mark.slow
@pytest.mark.parametrize("shown", ["shaded"], indirect=True)
@pytest.mark.parametrize("ripe_s", [math.inf, 0.0])
def test_a_full_picture_waits_for_the_light_of_its_tiles(shown, monkeypatch, ripe_s):
    """Otherwise it is drawn again for each group of tiles that gets light."""
    app, stored = shown
    unlit = []

    def noted(self, spec, stats, way, renderer):
        if way.is_full and stats[0]["complete"]:
            unlit.append(stats[0]["tiles_unlit"])
        note(self, spec, stats, way, renderer)

    note = painter.Painter._note
    monkeypatch.setattr(painter.Painter, "_note", noted)
    monkeypatch.setattr(painter, "RIPE_S", ripe_s)
    set_budget(app.viewer, FrameBudget(Ticking(), work_s=math.inf, motion_ms=-1.0))  # motion is drawn smaller
    app.viewer.settings.change_all(max_error_px=3.0)
    stored.gate.set()
    until_complete(app)
    assert (unlit == [0]) == (ripe_s > 0)


def test_a_large_raster_is_exaggerated_once_its_store_is_made(large, session_context, run, monkeypatch):
    raster, gate = large
    gate.set()
    opener = opener_of(run, monkeypatch, raster, "--exaggeration", 2)
    with app_alone(session_context) as app:
        app.viewer.settings.change_all(exaggeration=2.0)  # as the command gives it to the window
        app.viewer.loader.load(raster, opener)
        app.viewer.loader.job.join()
        until_complete(app)
        assert app.viewer.scene.is_paged and app.viewer.scene.exaggeration == 2
        app.viewer.hold_in_memory()
        app.viewer.loader.job.join()
        until_complete(app)
        scene = app.viewer.scene
        assert not scene.is_paged and scene.exaggeration == 2
        assert scene.heightmap.range_m[1] == pytest.approx(548.5)


def test_a_large_raster_of_the_dialog_gets_a_store_too(large):
    """While it is made, a sample is shown. If it cannot be made, the raster itself is read."""
    raster, gate = large
    gate.set()
    opened = file_opener(raster)(lambda _: None)
    assert opened.heightmap.cols == 100 and opened.rest
    of_store = opened.rest(lambda _: None)
    assert of_store.heightmap.is_store and of_store.note == ""


def test_a_large_file_that_gdal_cannot_read_in_parts_gets_a_store_without_a_sample(large, tmp_path):
    large[1].set()
    np.save(tmp_path / "hills.npy", np.add.outer(np.arange(80.0), np.sin(np.arange(90.0))))
    opened = file_opener(str(tmp_path / "hills.npy"))(lambda _: None)
    assert opened.heightmap.is_store and opened.heightmap.cols == 90
    assert opened.note == "hills.npy is drawn from a store; Hold in memory, under Map, reads the file"


def test_a_large_raster_whose_store_cannot_be_made_is_held_in_memory_and_a_line_says_why(large, make_app, monkeypatch):
    raster, _ = large

    def full(*_, **__):
        raise TerrainError("no space left on the disk")

    monkeypatch.setattr(cache, "build", full)
    app = make_app(with_map=False)
    app.viewer.open(raster)
    while app.viewer.loader.job:
        later(app)
    assert not app.viewer.scene.is_paged and app.viewer.scene.heightmap.cols == 400
    assert app.viewer.window.message == "no space left on the disk; huge.tif is held in memory instead"
