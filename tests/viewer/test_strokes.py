"""Strokes of the brush: they change the land, keep the bound, and can be undone."""

import math

import numpy as np
import pytest
from viewers import changed, hills, later, light_is_up_to_date, seen, set_budget, settle, slow, stroke, with_a_stroke

from terrain_gl.camera import Camera
from terrain_gl.error import ErrorTables
from terrain_gl.heightmap import Heightmap
from terrain_gl.renderer import Renderer
from terrain_gl.renderer.brush import TOOLS, dabs, places
from terrain_gl.terrain import Terrain
from terrain_gl.viewer.commands import press
from terrain_gl.viewer.loading import Opened


@pytest.mark.slow
def test_a_stroke_changes_the_land_and_the_bound_holds(viewer):
    settle(viewer)
    before = viewer.scene.renderer.heightmap.heights.copy()
    picture = seen(viewer)
    pose = viewer.scene.controller.pose
    press(viewer, "b")
    settle(viewer)
    viewer.sculpting.tool.strength_m = 30.0
    stroke(viewer, (150, 140), (190, 150))
    after = viewer.scene.renderer.heightmap.heights.copy()
    assert (after - before).max() > 20 and (after >= before).all() and viewer.scene.controller.pose == pose
    assert viewer.painter.frame.measured_px["max"] <= viewer.painter.frame.stats["certified_max_error_px"] <= 1
    assert changed(seen(viewer), picture) > 0.01
    assert viewer.sculpting.tool.strokes == (1, 0)
    rebuilt = Heightmap(after, 10.0)
    rebuilt.quantised_m = viewer.scene.renderer.heightmap.quantised_m
    built = ErrorTables(Terrain(viewer.ctx, rebuilt))
    press(viewer, "ctrl+z")
    settle(viewer)
    assert np.array_equal(viewer.scene.renderer.heightmap.heights, before)
    press(viewer, "ctrl+shift+z")
    settle(viewer)
    assert np.array_equal(viewer.scene.renderer.heightmap.heights, after)
    for name in ("nodes", "counters", "squares", "contributions"):
        assert getattr(built, name).read() == getattr(viewer.scene.renderer.tables, name).read(), name
    built.terrain.release()
    built.release()
    press(viewer, "ctrl+z")
    press(viewer, "ctrl+z")
    assert "nothing" in viewer.window.message


def test_a_stroke_far_above_the_map_waits_for_nothing(viewer):
    """The brush is taken at once, and each frame does dabs. New units are chosen on the way, and back."""
    settle(viewer)
    renderer = viewer.scene.renderer
    units_m, before = renderer.heightmap.quantised_m, renderer.heightmap.heights.copy()
    press(viewer, "b")
    assert viewer.sculpting.brushing and viewer.progress is None
    viewer.sculpting.tool.strength_m = 0.5 * np.ptp(renderer.heightmap.range_m)
    stroke(viewer, (160, 150), (190, 150))
    settle(viewer)
    assert np.ptp(renderer.heightmap.quantised_m) > 2 * np.ptp(units_m)
    assert viewer.painter.frame.measured_px["max"] <= viewer.painter.frame.stats["certified_max_error_px"] <= 1
    press(viewer, "ctrl+z")
    assert np.array_equal(renderer.heightmap.heights, before) and renderer.heightmap.quantised_m == units_m


@pytest.mark.slow
def test_undoing_is_seen_in_the_next_frame_and_soon_in_full(viewer):
    """On a slow machine: small at once, then in full size with the light before, then with new light."""
    settle(viewer)
    untouched = seen(viewer)
    press(viewer, "b")
    settle(viewer)
    stroke(viewer, (150, 140), (190, 150))
    set_budget(viewer, slow())
    press(viewer, "ctrl+z")
    later(viewer, 0.01)
    assert viewer.painter.drawn == viewer.scene.frame_spec() and not viewer.painter.frame.way.is_full
    while not viewer.painter.frame.way.is_full:
        assert viewer.painter.light.share is None
        later(viewer)
    settle(viewer)
    beside = np.s_[:, 270:]  # of the figures
    press(viewer, "b")
    settle(viewer)
    assert (
        np.abs(seen(viewer)[beside] - untouched[beside]).mean() < 2
    )  # heights are summed in the steps of a wider span
    assert viewer.painter.frame.measured_px


def test_a_brush_that_is_held_goes_on(viewer):
    settle(viewer)
    press(viewer, "b")
    settle(viewer)
    viewer.mouse.press("left", 160, 150)
    later(viewer)
    once = viewer.scene.renderer.heightmap.heights.copy()
    for _ in range(10):
        later(viewer)
    assert (viewer.scene.renderer.heightmap.heights - once).max() > 5 * viewer.sculpting.tool.strength_m
    viewer.mouse.release("left", 160, 150)
    assert viewer.sculpting.tool.strokes == (1, 0) and viewer.explainer.explanation is None


@pytest.mark.slow
def test_undoing_while_the_button_is_down_begins_another_stroke(viewer):
    before, after = with_a_stroke(viewer)
    viewer.mouse.press("left", 160, 150)
    later(viewer)
    press(viewer, "ctrl+z")
    assert np.array_equal(viewer.scene.renderer.heightmap.heights, after)
    viewer.mouse.move(180, 150)
    later(viewer)
    viewer.mouse.release("left", 180, 150)
    settle(viewer)
    assert viewer.sculpting.tool.strokes[0] == 2
    press(viewer, "ctrl+z")
    assert np.array_equal(viewer.scene.renderer.heightmap.heights, after)
    press(viewer, "ctrl+z")
    assert np.array_equal(viewer.scene.renderer.heightmap.heights, before)


def test_other_buttons_do_nothing_during_a_stroke(viewer):
    with_a_stroke(viewer)
    pose = viewer.scene.controller.pose
    viewer.mouse.press("left", 160, 150)
    later(viewer)
    viewer.mouse.press("right", 160, 150)
    viewer.mouse.move(190, 150)
    later(viewer)
    viewer.mouse.release("right", 190, 150)
    assert viewer.sculpting.held and viewer.scene.controller.pose == pose
    viewer.mouse.release("left", 190, 150)
    settle(viewer)
    assert viewer.sculpting.tool.strokes == (2, 0) and light_is_up_to_date(viewer)


def test_a_stroke_reaches_where_the_button_came_up(viewer):
    """Also a stroke between two frames."""
    settle(viewer)
    press(viewer, "b")
    settle(viewer)
    end = viewer.pointer.place_under(240, 150)
    viewer.mouse.press("left", 120, 150)
    viewer.mouse.move(240, 150)
    viewer.mouse.release("left", 240, 150)
    settle(viewer)
    col, row = round(end[0] / 10), round(128 - end[1] / 10)
    raised_m = (viewer.scene.renderer.heightmap.heights - hills().heights)[row, col]
    assert raised_m > 0.5 * viewer.sculpting.tool.strength_m


def test_light_follows_a_stroke_of_a_single_step(viewer):
    settle(viewer)
    press(viewer, "b")
    settle(viewer)
    set_budget(viewer, slow())
    viewer.mouse.press("left", 160, 150)
    viewer.mouse.release("left", 160, 150)
    while viewer.sculpting.at_work:
        later(viewer, 0.01)
    assert viewer.sculpting.tool.strokes == (1, 0) and light_is_up_to_date(viewer)


def test_a_map_that_arrives_during_a_stroke_is_not_sculpted(viewer):
    with_a_stroke(viewer)
    viewer.mouse.press("left", 160, 150)
    later(viewer)
    heightmap = Heightmap(hills().heights + 50, 10.0, "other")
    viewer.show(Renderer(heightmap, (32, 20), ctx=viewer.ctx), Opened(heightmap, Camera.default(heightmap)))
    for _ in range(5):
        later(viewer)
    viewer.mouse.release("left", 160, 150)
    settle(viewer)
    assert viewer.sculpting.tool.strokes == (0, 0) and not viewer.sculpting.unsaved
    assert np.array_equal(viewer.scene.renderer.heightmap.heights, heightmap.heights)


@pytest.mark.slow
def test_strokes_are_made_and_undone_on_exaggerated_land(viewer):
    before, after = with_a_stroke(viewer)
    viewer.exaggerate(2.0)
    settle(viewer)
    assert np.array_equal(viewer.scene.heightmap.heights, after) and viewer.sculpting.unsaved
    place = viewer.pointer.place_under(160, 150)
    stroke(viewer, (160, 150), (160, 150))
    risen = viewer.scene.heightmap.heights - after
    row, col = np.unravel_index(risen.argmax(), risen.shape)
    assert risen.max() > 0 and math.dist((10 * col, 10 * (128 - row)), place[:2]) < 15
    for _ in range(2):
        press(viewer, "ctrl+z")
        settle(viewer)
    assert np.array_equal(viewer.scene.heightmap.heights, before) and not viewer.sculpting.unsaved


def test_a_long_stroke_is_done_in_steps_after_the_button_is_up(viewer):
    """It is one stroke, and gives the same heights as single dabs."""
    settle(viewer)
    press(viewer, "b")
    settle(viewer)
    set_budget(viewer, slow())
    start, end = viewer.pointer.place_under(60, 150), viewer.pointer.place_under(280, 170)
    brush, plain = viewer.sculpting.tool.brush, Heightmap(hills().heights, 10.0)
    for middle in [tuple(start[:2]), *places(tuple(start[:2]), tuple(end[:2]), 0.3 * brush.radius_m)]:
        patch = dabs(plain, brush, [middle])
        plain.heights[patch.rows, patch.cols] = patch.heights
    viewer.mouse.press("left", 60, 150)
    later(viewer, 0.01)
    viewer.mouse.move(280, 170)
    later(viewer, 0.01)
    viewer.mouse.release("left", 280, 170)
    left = [len(viewer.sculpting.tool.due)]
    while viewer.sculpting.at_work:
        assert viewer.busy
        later(viewer)
        left.append(len(viewer.sculpting.tool.due))
    assert len(left) > 3 and left == sorted(left, reverse=True)
    settle(viewer)
    assert np.array_equal(viewer.scene.renderer.heightmap.heights, plain.heights)
    assert viewer.sculpting.tool.strokes == (1, 0) and viewer.painter.frame.measured_px["max"] <= 1
    press(viewer, "ctrl+z")
    assert np.array_equal(viewer.scene.renderer.heightmap.heights, hills().heights)


def test_keys_change_the_tool_the_radius_and_the_strength(viewer):
    settle(viewer)
    press(viewer, "b")
    tools = set()
    for _ in TOOLS:
        press(viewer, "x")
        tools.add(viewer.sculpting.tool.tool)
        before = viewer.sculpting.tool.brush
        for key in ("]", ".", "]", "."):
            press(viewer, key, repeated=True)
        brush = viewer.sculpting.tool.brush
        assert brush.radius_m > before.radius_m and brush.strength > before.strength
        for key in ("[", ","):
            for _ in range(500):
                press(viewer, key)
        assert viewer.sculpting.tool.brush.radius_m > 0 and viewer.sculpting.tool.brush.strength > 0
    assert tools == set(TOOLS)
    press(viewer, "escape")
    assert not viewer.sculpting.brushing and not viewer.window.closing
