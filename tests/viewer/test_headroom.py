"""Strokes beyond the height range of the tables wait for new tables."""

import numpy as np
import pytest
from viewers import hills, later, light_is_up_to_date, set_budget, settle, slow, stroke, swift, with_a_stroke

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.heightmap import Heightmap
from terrain_gl.renderer import Renderer
from terrain_gl.viewer.commands import press


def test_headroom_for_the_brush_is_built_in_steps(viewer):
    settle(viewer)
    set_budget(viewer, slow())
    press(viewer, "b")
    assert viewer.progress == ("preparing the brush", viewer.sculpting.share, True) and viewer.busy
    press(viewer, "escape")
    assert not viewer.sculpting.headroom and not viewer.window.closing and viewer.progress is None
    press(viewer, "b")
    frames = 0
    while not viewer.sculpting.brushing:
        assert viewer.painter.frame.measured_px or frames == 0
        later(viewer)
        frames += 1
    assert frames > 3 and "drag on the land" in viewer.window.message
    press(viewer, "b")
    assert not viewer.sculpting.brushing
    press(viewer, "b")
    assert viewer.sculpting.brushing  # at once: there is room


@pytest.mark.slow
def test_a_held_brush_waits_for_headroom_and_goes_on(viewer):
    """However far it raises the land: new tables are built in steps, never at once."""
    settle(viewer)
    set_budget(viewer, slow())
    press(viewer, "b")
    settle(viewer)
    renderer, tool = viewer.scene.renderer, viewer.sculpting.tool
    relief_m = np.ptp(renderer.heightmap.range_m)
    tool.strength_m = 0.3 * relief_m
    viewer.mouse.press("left", 160, 150)
    waited = 0
    while renderer.heightmap.range_m[1] < 100 + 5 * relief_m:
        reach, heights, edited = renderer.heightmap.quantised_m, renderer.terrain.heights, renderer.heightmap.range_m
        waits = viewer.sculpting.headroom is not None
        later(viewer)
        if waits and viewer.sculpting.headroom:
            waited += 1
            assert renderer.heightmap.range_m == edited and viewer.progress[0] == "preparing the brush"
        assert renderer.heightmap.quantised_m == reach or renderer.terrain.heights is not heights
    assert waited > 3 and tool.brush.strength == tool.strength_m
    viewer.mouse.release("left", 160, 150)
    settle(viewer)
    assert tool.strokes == (1, 0) and viewer.painter.frame.measured_px["max"] <= 1
    rebuilt = Heightmap(renderer.heightmap.heights, renderer.heightmap.spacing_m)
    rebuilt.quantised_m = renderer.heightmap.quantised_m
    with Renderer(rebuilt, ctx=viewer.ctx) as built:
        assert built.tables.nodes.read() == renderer.tables.nodes.read()
    press(viewer, "ctrl+z")
    assert np.array_equal(renderer.heightmap.heights, hills().heights)


def waiting_stroke(viewer):
    """Begin a stroke whose dabs wait for headroom, the button still down; returns the brush."""
    tool = viewer.sculpting.tool
    tool.strength_m = 3 * np.ptp(viewer.scene.renderer.heightmap.range_m)
    set_budget(viewer, slow())
    viewer.mouse.press("left", 160, 150)
    while not viewer.sculpting.headroom:
        later(viewer)
    return tool


@pytest.mark.parametrize("key", ["escape", "b"])
def test_a_stroke_that_waits_for_headroom_can_be_cancelled(viewer, key):
    _, after = with_a_stroke(viewer)
    tool = waiting_stroke(viewer)
    press(viewer, key)
    assert not (viewer.sculpting.headroom or tool.due or viewer.sculpting.held or viewer.window.closing)
    settle(viewer)
    viewer.mouse.release("left", 160, 150)
    settle(viewer)
    assert viewer.sculpting.brushing == (key == "escape") and light_is_up_to_date(viewer)
    while tool.strokes[0] > 1:
        press(viewer, "ctrl+z")
    assert np.array_equal(viewer.scene.renderer.heightmap.heights, after)


@pytest.mark.parametrize("held", [True, False])
def test_undoing_a_stroke_that_waits_for_headroom_leaves_the_one_before(viewer, held):
    before, after = with_a_stroke(viewer)
    tool = waiting_stroke(viewer)
    if not held:
        viewer.mouse.release("left", 160, 150)
    press(viewer, "ctrl+z")
    assert np.array_equal(viewer.scene.renderer.heightmap.heights, after)
    if held:
        viewer.mouse.release("left", 160, 150)
    set_budget(viewer, swift())
    settle(viewer)
    while tool.strokes[0] > 1:  # what was held went on as a stroke of its own
        press(viewer, "ctrl+z")
    assert np.array_equal(viewer.scene.renderer.heightmap.heights, after)
    press(viewer, "ctrl+z")
    assert np.array_equal(viewer.scene.renderer.heightmap.heights, before)


@pytest.mark.slow
def test_strokes_that_wait_for_headroom_stay_separate(viewer):
    before, after = with_a_stroke(viewer)
    tool = waiting_stroke(viewer)
    viewer.mouse.release("left", 160, 150)
    stroke(viewer, (200, 150), (210, 150))
    set_budget(viewer, swift())
    settle(viewer)
    assert tool.strokes == (3, 0)
    press(viewer, "ctrl+z")
    press(viewer, "ctrl+z")
    assert np.array_equal(viewer.scene.renderer.heightmap.heights, after)


@pytest.mark.parametrize("lead", range(1, 30, 2))
def test_headroom_is_built_while_the_picture_comes_to_rest(viewer, lead):
    settle(viewer)
    set_budget(viewer, slow())
    press(viewer, "b")
    for _ in range(lead):
        later(viewer, 0.05)
    viewer.scene.controller.look(3, 0)
    viewer.window.refresh()
    for _ in range(40):
        later(viewer, 0.3)
    settle(viewer)
    assert viewer.sculpting.brushing and viewer.painter.frame.measured_px["max"] <= 1


def test_without_memory_for_headroom_sculpting_still_works(viewer, monkeypatch):
    settle(viewer)

    def reserve(*_):
        raise TerrainError("an error table of 9 GiB is more than there is")

    with monkeypatch.context() as patched:
        patched.setattr("terrain_gl.error.gl.reserve", reserve)
        press(viewer, "b")
        settle(viewer)
    assert "9 GiB" in viewer.window.message and viewer.sculpting.brushing
    viewer.sculpting.tool.strength_m = 1000.0
    stroke(viewer, (160, 150), (165, 150))
    settle(viewer)
    assert viewer.scene.renderer.heightmap.range_m[1] > 900 and viewer.painter.frame.measured_px["max"] <= 1


def test_a_brush_taken_and_put_away_leaves_the_picture_as_it_was(viewer):
    """To the bit: no stroke, no other colours, no other mesh."""
    settle(viewer)
    before = viewer.scene.renderer.picture.read()
    press(viewer, "b")
    settle(viewer)
    held = viewer.scene.heightmap.quantised_m
    assert viewer.sculpting.brushing and held != viewer.scene.heightmap.range_m
    press(viewer, "b")
    assert viewer.progress[0] == "putting the brush away"
    settle(viewer)
    assert viewer.scene.heightmap.quantised_m == viewer.scene.heightmap.range_m and viewer.progress is None
    assert np.array_equal(viewer.scene.renderer.picture.read(), before)


def test_a_brush_that_was_used_keeps_its_headroom(viewer):
    with_a_stroke(viewer)
    held = viewer.scene.heightmap.quantised_m
    press(viewer, "b")
    settle(viewer)
    assert not viewer.sculpting.brushing and viewer.scene.heightmap.quantised_m == held
