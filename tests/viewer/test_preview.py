"""While the tables of a large map are built, its preview is shown. A preview certifies and measures nothing."""

import re

import numpy as np
import pytest
from viewers import later, set_budget, settle, slow, swift, texts

from terrain_gl.camera import Camera
from terrain_gl.heightmap import Heightmap
from terrain_gl.viewer.loading import PREVIEW_POSTS, Opened

_ERROR_WORDS = r"\d px, bound|at most [\d.]+ px|achieved [\d.…]+ px"


def large_map():
    n = 4 * PREVIEW_POSTS + 1
    heights = np.add.outer(np.sin(np.arange(n) / 4.0), np.cos(np.arange(n - 500) / 60.0)) * 200
    return Heightmap(heights, (10.0, 12.0), "large")


def show_preview(app, heightmap):
    """Load a map until its preview is drawn."""
    set_budget(app.viewer, slow())
    app.viewer.loader.load("large", lambda progress: Opened(heightmap, Camera.default(heightmap), key="large"))
    app.viewer.loader.job.join()
    while not app.viewer.painter.frame.stats:
        app.frame(app.viewer.window.now_s + 1.0)
    assert app.viewer.scene.is_preview and app.viewer.loader.job


@pytest.fixture
def preview(make_app, folder):
    """An app that shows the preview of its first map."""
    app = make_app(with_map=False)
    show_preview(app, large_map())
    return app


def test_a_preview_says_so_and_shows_no_error(preview):
    shown = texts(preview)
    assert "large   preview" in shown and "nothing certified" in shown and "preview: a coarse sample" in shown
    assert not re.search(_ERROR_WORDS, shown), shown
    stats = preview.viewer.painter.frame.stats
    assert stats["certified_max_error_px"] is None and stats["complete"] is False
    assert stats["triangles"] < 2 * PREVIEW_POSTS**2  # the sample, not the map


WAITS = "preparing a preview of|drawing the first picture|building the tables of|computing light|drawing in full size"


@pytest.mark.slow
def test_until_the_picture_is_finished_a_line_says_what_is_waited_for(make_app, folder):
    app, heightmap = make_app(with_map=False), large_map()
    app.viewer.settings.change_all(style="shaded")
    set_budget(app.viewer, slow())
    app.viewer.loader.load("large", lambda progress: Opened(heightmap, Camera.default(heightmap), key="large"))
    app.viewer.loader.job.join()
    waited_for, shares, panels = [], [], []
    while not app.viewer.settled:
        later(app, 0.3)
        shown = texts(app)
        if not app.viewer.settled:
            found = re.search(WAITS, shown)
            assert found and "at rest" not in shown, (waited_for, shown)
            waited_for += [found[0]] * (found[0] not in waited_for)
            shares.append((found[0], app.viewer.progress.share))
        if app.viewer.scene.has_map:
            panels.append(min(app.gui.widgets.covered))  # its box, at the left: controls do not move under the mouse
    assert panels and {*panels} == {panels[0]}
    assert waited_for == WAITS.split("|") and shares == sorted(shares, key=lambda each: waited_for.index(each[0]))
    for what in waited_for:
        of_it = [share for said, share in shares if said == what]
        assert of_it == sorted(of_it) and len(set(of_it)) > 1, (what, of_it)
    settle(app)
    assert "at rest" in texts(app) and app.viewer.progress is None


@pytest.mark.slow
def test_the_whole_map_has_a_bound_again(preview):
    set_budget(preview.viewer, swift())
    settle(preview)
    frame, shown = preview.viewer.painter.frame, texts(preview)
    assert frame.achieved_px <= frame.certified_px <= 1
    assert re.search(_ERROR_WORDS, shown) and "preview" not in shown


def test_a_split_preview_has_no_bound_on_either_side(preview):
    preview.press("t")
    preview.frame(preview.viewer.window.now_s + 0.1)
    assert len(preview.viewer.painter.side_stats) == 1  # the divider over the picture that was there
    preview.frame(preview.viewer.window.now_s + 0.1)
    assert preview.viewer.scene.is_preview and preview.viewer.painter.frame.is_sketch
    assert not re.search(_ERROR_WORDS, texts(preview))


@pytest.mark.slow
def test_a_new_split_is_a_preview_without_numbers(make_app):
    app = make_app()
    app.viewer.settings.divider = 0.6  # both sides have room for their text
    app.press("t")
    for _ in range(2):
        app.frame(app.viewer.window.now_s + 0.01)
    shown = texts(app)
    assert app.viewer.painter.frame.is_sketch
    for side in app.viewer.settings.sides:
        assert f"preview of {side.method}; it promises nothing" in shown
    assert not re.search(_ERROR_WORDS + r"|[\d,]+ triangles|[\d,]+ patches| ms ", shown), shown
    settle(app)
    assert "promises nothing" not in texts(app) and re.search(r"achieved [\d.]+ px", texts(app))


@pytest.mark.parametrize("key", ["p", "o"])
def test_a_preview_is_not_saved(preview, tmp_path, key):
    preview.press(key)
    assert "preview" in preview.viewer.window.message
    preview.viewer.saver.join()
    assert not preview.viewer.saver.shot and not list(tmp_path.iterdir())


def test_a_preview_is_not_explained(preview):
    preview.viewer.mouse.press("left", 600, 500)
    preview.viewer.mouse.release("left", 600, 500)
    preview.viewer.mouse.step(0.0)
    preview.viewer.mouse.step(1.0)  # no second click has followed
    assert preview.viewer.explainer.explanation is None and "preview" in preview.viewer.window.message


@pytest.mark.slow
@pytest.mark.parametrize("style", ["promise", "error"])
def test_a_preview_has_no_colours_of_errors(preview, style):
    preview.viewer.settings.change(style=style)
    assert preview.viewer.scene.frame_spec().sides[0].style == "lambert"
    set_budget(preview.viewer, swift())
    settle(preview)
    assert preview.viewer.scene.frame_spec().sides[0].style == style


@pytest.mark.slow
def test_another_map_that_arrives_during_a_preview_has_its_own_view(preview):
    """It is not the map whose sample is shown: the camera of the sample may be under its ground, or far away."""
    viewer = preview.viewer
    other = Heightmap(large_map().heights[:300, :200] + 5000, 3.0, "other")
    opened = Opened(other, Camera.default(other), key="other")
    of_sample = viewer.scene.controller.pose
    viewer.loader.load("other", lambda progress: opened)
    set_budget(viewer, swift())
    settle(preview)
    controller = viewer.scene.controller
    assert viewer.scene.heightmap is other and controller.pose != of_sample
    np.testing.assert_allclose(controller.eye, viewer.scene.beside_panel(opened.camera).eye, rtol=1e-12)
    viewer._remember_map()
    np.testing.assert_allclose(viewer.memory.last_pose("other").eye, controller.eye, atol=0.01)
