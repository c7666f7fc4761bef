"""Frozen levels, split pictures, explained patches, boxes of the summed-area table."""

import numpy as np
import pytest
from viewers import changed, later, seen, set_budget, settle, slow, swift

from terrain_gl.camera import Camera
from terrain_gl.renderer.methods import BASELINES, METHODS
from terrain_gl.renderer.options import FrameOptions
from terrain_gl.viewer import explain_text
from terrain_gl.viewer.box_sum import box_around
from terrain_gl.viewer.commands import press
from terrain_gl.viewer.controller import Pose
from terrain_gl.viewer.frame_budget import COARSEST
from terrain_gl.viewer.settings import SCALE_PX
from terrain_gl.viewer.split import Split
from terrain_gl.viewer.state import state_of


def test_a_click_explains_the_patch_and_a_drag_does_not(viewer):
    settle(viewer)
    viewer.mouse.press("left", 160, 150)
    viewer.mouse.move(200, 150)
    viewer.mouse.release("left", 200, 150)
    assert viewer.explainer.explanation is None and viewer.scene.controller.pose != Pose.of(
        viewer.scene.controller.start
    )
    viewer.scene.controller.home()
    settle(viewer)
    place = viewer.pointer.place_under(160, 150)
    viewer.mouse.press("left", 160, 150)
    viewer.mouse.release("left", 160, 150)
    assert viewer.explainer.explanation is None  # a second click may follow
    settle(viewer)
    told = viewer.explainer.explanation
    col, row = place[0] / 10, 128 - place[1] / 10
    assert all(0 <= at - first <= told.side for at, first in zip((col, row), told.corner, strict=True))
    assert told.chosen.px <= 1 and explain_text.title(told)
    verdicts = [row[-1] for row in explain_text.rows(told)]
    assert verdicts.count("drawn") == 1 and {"too coarse", "finer than needed"} & set(verdicts)
    assert all(sentence.endswith(".") for sentence in explain_text.reasons(told))
    settle(viewer)
    viewer.mouse.press("left", 160, 3)  # the sky
    viewer.mouse.release("left", 160, 3)
    settle(viewer)
    assert viewer.explainer.explanation is None


def test_the_frozen_mesh_stays_while_the_eye_goes_on(viewer, monkeypatch):
    """It is the whole mesh of the frozen eye: nothing outside its picture, nothing that a ridge hides from it."""
    viewer.settings.panel = False
    settle(viewer)
    viewer.settings.change(style="lod")
    settle(viewer)
    before = viewer.painter.frame.stats["triangles"]
    press(viewer, "l")
    with monkeypatch.context() as patch:  # nothing is chosen again: the window holds the mesh
        patch.setattr("terrain_gl.lod.RingsSelector.select", None)
        viewer.scene.controller.pose = Pose.of(Camera((-400.0, -500.0, 700.0), (550.0, 200.0, 150.0)))
        settle(viewer)
    assert viewer.painter.frame.stats["triangles"] == before and viewer.painter.frame.measured_px["max"] <= 1
    picture = seen(viewer)
    orange = (np.abs(picture - [255, 205, 120]).max(-1) < 12).sum()
    press(viewer, "l")
    settle(viewer)
    assert viewer.painter.frame.stats["triangles"] != before
    assert orange > 50 > (np.abs(seen(viewer) - [255, 205, 120]).max(-1) < 12).sum()


def test_a_split_picture_shows_two_settings(viewer):
    viewer.settings.panel = False
    settle(viewer)
    plain = seen(viewer)
    press(viewer, "t")
    viewer.settings.sides = [FrameOptions(), FrameOptions()]
    viewer.settings.active = 1
    viewer.settings.change(style="normals")
    viewer.window.message = ""
    settle(viewer)
    split = seen(viewer)
    assert np.array_equal(split[:, :158], plain[:, :158]) and changed(split[:, 162:], plain[:, 162:]) > 0.4
    viewer.mouse.press("left", 161, 100)
    viewer.mouse.move(80, 100)
    viewer.mouse.release("left", 80, 100)
    settle(viewer)
    moved = seen(viewer)
    assert viewer.settings.divider == 0.25 and viewer.explainer.explanation is None
    assert np.array_equal(moved[:, :78], plain[:, :78]) and changed(moved[:, 82:160], plain[:, 82:160]) > 0.4
    viewer.mouse.move(20, 50)
    assert viewer.settings.active == 0
    viewer.mouse.move(200, 50)
    assert viewer.settings.active == 1
    viewer.mouse.press("left", 200, 150)
    viewer.mouse.release("left", 200, 150)
    settle(viewer)
    assert viewer.explainer.explanation.tolerance_px == 1.0
    press(viewer, "t")
    settle(viewer)
    viewer.explainer.explanation, viewer.window.message = None, ""
    settle(viewer)
    assert np.array_equal(seen(viewer), plain)


def test_the_preview_of_a_split_has_each_side_by_its_own_method(viewer):
    settle(viewer)
    press(viewer, "t")
    later(viewer, 0.02)
    later(viewer, 0.02)
    shown, width = seen(viewer), viewer.window.size[0]
    assert viewer.painter.frame.is_sketch
    renderer, camera = viewer.scene.renderer, viewer.scene.controller.camera
    middle = round(viewer.settings.divider * width)
    for side, columns in zip(viewer.settings.sides, (slice(middle - 2), slice(middle + 2, None)), strict=True):
        renderer.draw(camera, method=side.method, style="lambert", metric="max", max_error_px=COARSEST.looser)
        viewer.painter.canvas.take(renderer, viewer.window.size)
        viewer.painter.canvas.show(viewer.target)
        assert np.array_equal(seen(viewer)[:, columns], shown[:, columns])
    settle(viewer)
    assert not viewer.painter.frame.is_sketch and changed(seen(viewer), shown) > 0.2
    press(viewer, "t")
    settle(viewer)
    press(viewer, "t")
    later(viewer, 0.02)  # its programs are known now: no preview
    assert len(viewer.painter.side_stats) == 2 and not viewer.painter.frame.is_sketch


@pytest.mark.slow
def test_a_split_begins_with_equal_triangles_and_error_colours(viewer):
    viewer.settings.change(max_error_px=0.5)
    settle(viewer)
    before, count = viewer.settings.options, viewer.painter.frame.stats["triangles"]
    set_budget(viewer, slow())
    press(viewer, "t")
    whole = seen(viewer)
    assert later(viewer, 0.02)  # at once, before programs are compiled: the old picture, and the divider
    at_once = seen(viewer)
    assert len(viewer.painter.side_stats) == 1 and 0.001 < changed(at_once, whole) < 0.05
    assert later(viewer, 0.05) and viewer.painter.frame.is_sketch  # before the programs and the equal triangles
    assert changed(seen(viewer), at_once) > 0.2 and len(viewer.painter.side_stats) == 1
    set_budget(viewer, swift())
    settle(viewer)
    left, right = viewer.settings.sides
    assert (left.method, right.method, left.style, right.style) == ("sat", BASELINES[0], "error", "error")
    drawn = [stats["triangles"] for stats in viewer.painter.side_stats]
    assert left.triangles == right.triangles == count and abs(drawn[0] - drawn[1]) <= 0.02 * count
    assert left.error_scale_px == right.error_scale_px == SCALE_PX
    renderer, camera = viewer.scene.renderer, viewer.scene.controller.camera
    for side, found in zip((right, left), viewer.painter.side_measured[::-1], strict=True):
        renderer.draw(camera, **vars(side))
        assert found["max"] == pytest.approx(renderer.measure()["max_error_px"], rel=1e-9)
    assert viewer.explainer.unsplit == before
    viewer.settings.change(style="lod")
    press(viewer, "t")
    assert viewer.settings.options == before.otherwise(style="lod")


def test_in_a_frozen_view_drawn_places_are_explained_and_no_others(viewer):
    settle(viewer)
    press(viewer, "l")
    controller, renderer = viewer.scene.controller, viewer.scene.renderer
    middle = 0.5 * np.array(viewer.scene.heightmap.extent_m)
    controller.pose = Pose((*middle, 1900.0), 0.0, -89.0, 42.0)  # the whole map, from above
    settle(viewer)
    is_drawn = []
    for x in range(20, 320, 20):
        for y in range(10, 200, 20):
            viewer.explainer.explain(x, y)
            if (place := viewer.explainer.place) is None:
                continue
            told = viewer.explainer.explanation
            is_drawn.append(not np.isnan(renderer.drawn_height_at(*map(float, place[:2]))))
            assert is_drawn[-1] == (told is not None and not told.hidden_by), (x, y)
    assert min(sum(is_drawn), len(is_drawn) - sum(is_drawn)) > 5


def both_sides(viewer):
    """The whole pictures of a split, by side."""
    settle(viewer)
    canvas, width = viewer.painter.canvas, viewer.window.size[0]
    whole = []
    for side in range(2):
        canvas.show(viewer.target, Split(2, 1.0 if side == 0 else 0.0))
        whole.append(seen(viewer)[:, 2 : width - 2])  # without the line between the sides
    return whole


def test_lines_stay_where_they_are_when_a_frozen_patch_is_explained(viewer):
    """The explanation reads the frozen camera's view; lines over the picture belong to the user's eye."""
    viewer.settings.panel = False
    viewer.settings.change(style="lod")
    settle(viewer)
    press(viewer, "l")
    viewer.scene.controller.pose = Pose.of(Camera((-400.0, -500.0, 700.0), (550.0, 200.0, 150.0)))
    settle(viewer)

    def frustum():
        viewer.draw()
        return (np.abs(seen(viewer) - (255, 205, 120)).max(-1) < 40).nonzero()

    before = frustum()
    assert len(before[0]) > 100
    for x in range(100, 300, 20):
        viewer.explainer.explain(float(x), 100.0)
        if viewer.explainer.explanation:
            break
    assert viewer.explainer.explanation
    viewer.explainer.explanation = None
    assert np.array_equal(frustum(), before)


def test_a_ring_is_around_the_largest_error(viewer):
    settle(viewer)
    plain = seen(viewer)
    assert viewer.explainer.worst(0) is None
    viewer.settings.change(style="error", max_error_px=4.0)
    settle(viewer)
    white = (seen(viewer) > 225).all(-1).nonzero()
    assert len(white[0]) > 20 and (plain[white] > 225).all(-1).mean() < 0.5
    row, col = (round(float(each.mean())) for each in white)
    errors = viewer.scene.renderer.inspector.error_map()
    around = errors[row - 3 : row + 4, col - 3 : col + 4]
    assert np.nanmax(around) > 0.85 * np.nanmax(errors) > 2 * np.nanmean(errors)
    pose = viewer.scene.controller.pose
    viewer.go_to("largest error")
    settle(viewer)
    assert "no point" not in viewer.window.message and viewer.scene.controller.pose != pose


def test_the_legend_of_levels_has_only_those_in_the_picture_in_metres(viewer):
    viewer.settings.change(style="lod", max_error_px=2.0)
    settle(viewer)
    fine = viewer.legend(0)
    viewer.settings.change(max_error_px=16.0)
    settle(viewer)
    coarse = viewer.legend(0)
    assert fine.least != coarse.least or fine.note != coarse.note
    mesh = viewer.painter.meshes[0]
    assert coarse.most == f"{10 * 2 ** mesh.steps_log2[-1]:g} m"
    assert mesh.steps_log2[0] > 0 and len(coarse.ramp) == max(len(mesh.steps_log2), 2)


def test_the_sides_change_places_and_the_divider_moves_without_drawing(viewer, monkeypatch):
    settle(viewer)
    press(viewer, "t")
    viewer.settings.change_all(style="lod")  # in the style of errors, a ring is over the picture
    left, right = both_sides(viewer)
    assert changed(left, right) > 0.02
    viewer.window.refresh()
    monkeypatch.setattr(viewer.scene.renderer, "draw_steps", None)  # a picture drawn now would be an error
    for _ in range(2):
        for divider in (0.3, 0.6):
            viewer.settings.split_at(divider)
            viewer.window.refresh()
            later(viewer)
            middle = round(divider * viewer.window.size[0])
            shown = seen(viewer)[:, 2:-2]
            assert np.array_equal(shown[:, : middle - 4], left[:, : middle - 4])
            assert np.array_equal(shown[:, middle + 2 :], right[:, middle + 2 :])
        press(viewer, "shift+t")
        left, right = right, left
    press(viewer, "shift+t")
    later(viewer)
    assert viewer.pointer.side_at(10) == 1 and viewer.pointer.side_at(310) == 0
    saved = state_of(viewer.scene, viewer.layers)
    press(viewer, "t")
    assert not viewer.settings.swapped and saved["swapped"]


def test_one_key_shows_another_method_in_place(viewer):
    settle(viewer)
    press(viewer, "shift+t")
    settle(viewer)
    one = seen(viewer)
    press(viewer, "shift+t")
    later(viewer)
    assert changed(seen(viewer)[:, :300], one[:, :300]) > 0.02 and viewer.settings.divider > 0.95


def test_both_sides_show_the_same_land(viewer):
    """Then pixels at equal distances from the middles of the sides show, and point at, the same place."""
    settle(viewer)
    press(viewer, "t")
    viewer.settings.divider = 0.5
    viewer.settings.panel = False
    viewer.settings.sides[1] = viewer.settings.sides[0]
    settle(viewer)
    width = viewer.window.size[0]
    apart = seen(viewer)
    press(viewer, "ctrl+t")
    later(viewer)
    same = seen(viewer)
    half = width // 2
    assert changed(apart[:, 3 : half - 3], apart[:, half + 3 : width - 3]) > 0.1
    assert np.array_equal(same[:, 3 : half - 3], same[:, half + 3 : width - 3])
    at = [viewer.pointer.place_under(x, 150) for x in (60, 60 + half)]
    assert np.array_equal(*at) and not np.array_equal(at[0], viewer.pointer.place_under(60 + half // 2, 150))
    viewer.explainer.explain(60 + half, 150)
    later(viewer)
    marked = seen(viewer)
    assert changed(marked, same) > 0.001  # the outline of the patch, on both sides
    sides = marked[:, 3 : half - 3], marked[:, half + 3 : width - 3]
    assert changed(*sides) < 0.1 * changed(sides[0], same[:, 3 : half - 3])


@pytest.mark.slow
def test_only_sat_explains_patches(viewer):
    for method in METHODS:
        viewer.settings.change(method=method)
        settle(viewer)
        viewer.explainer.explain(160, 150)
        explained = viewer.explainer.explanation is not None
        assert explained == (method == "sat")
        assert explained or "method sat explains its patches" in viewer.window.message


def test_the_magnifying_glass_shows_pixels_as_squares(viewer):
    viewer.settings.panel = False
    settle(viewer)
    plain = seen(viewer)
    press(viewer, "z")
    viewer.window.scale = 0.3
    viewer.mouse.move(160, 120)
    settle(viewer)
    lens = seen(viewer)
    for dx, dy in ((0, 0), (2, 1), (-3, 2)):  # the middle of the square of a pixel near the middle
        x, y = 160 + round(6 * (dx + 0.5)), 120 - round(6 * (dy + 0.5))
        assert np.array_equal(lens[y, x], plain[119 - dy, 160 + dx])
    assert np.array_equal(lens[:60], plain[:60])


def test_the_summed_area_table_gives_the_mean_of_a_box(viewer):
    settle(viewer)
    press(viewer, "u")
    viewer.settings.box = 20
    for x in (120, 160, 200):
        viewer.mouse.move(x, 140)
        settle(viewer)
        x0, y0, x1, y1 = viewer.explainer.box.box
        true_mean = viewer.scene.renderer.heightmap.heights[y0:y1, x0:x1].mean()
        assert viewer.explainer.box.mean_m == pytest.approx(true_mean, abs=0.002)
    whole = box_around(viewer.scene.renderer, np.array([640.0, 640.0]), 129)
    assert whole.box == (0, 0, 129, 129) and whole.corners[:3] == (0, 0, 0)
    left, bottom, width, height = viewer.sums_frame
    picture = seen(viewer)[200 - bottom - height : 200 - bottom, left : left + width]
    assert np.abs(picture - [115, 242, 140]).max(-1).min() < 5  # the corners that add
    viewer.scene.renderer.edit(slice(9), slice(9), -40.0)  # below the table's range
    deep = box_around(viewer.scene.renderer, np.array([0.0, 1280.0]), 40)
    x0, y0, x1, y1 = deep.box
    true_mean = viewer.scene.renderer.heightmap.heights[y0:y1, x0:x1].mean()
    assert deep.steps_below > 0 and deep.mean_m == pytest.approx(true_mean, abs=0.002)


def test_wires_are_drawn_over_the_picture(viewer):
    settle(viewer)
    before = seen(viewer)
    press(viewer, "n")
    settle(viewer)
    brighter = (seen(viewer) - before).min(-1) > 8
    assert 0.02 < brighter.mean() < 0.6
