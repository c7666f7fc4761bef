"""The panels, without a window: real events of mouse and keyboard."""

import itertools
import sys
import time

import numpy as np
import pytest
from viewers import changed, hills, later, listen, seen, set_budget, settle, slow, texts

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.lod import METRICS
from terrain_gl.renderer.methods import METHODS
from terrain_gl.viewer import legend, run
from terrain_gl.viewer.charts import error_words
from terrain_gl.viewer.commands import shown_lines
from terrain_gl.viewer.panels import scale_of
from terrain_gl.viewer.pose import Pose
from terrain_gl.viewer.settings import UI_SCALES, UI_STEP


def drag(app, start, end):
    """Press the left button at one place and release it at another."""
    app.gui.move(*start)
    later(app, 0.1)
    app.gui.button("left", True)
    later(app, 0.1)
    app.gui.move(*end)
    later(app, 0.1)
    app.gui.button("left", False)
    settle(app)


def slider(app, label):
    """Left, top, right and bottom of a control."""
    return app.gui.widgets.places[label]


def test_panels_stand_at_the_left_and_leave_the_middle_free(app):
    with_panel = seen(app)
    app.press("i")
    settle(app)
    bare = seen(app)
    differ = (with_panel != bare).any(-1)
    assert (
        differ[20:300, 20:200].mean() > 0.9 and not differ[:500, 450:].any()
    )  # north and scale, at the lower right, go with it
    assert app.gui.covers(100, 100) is False


def test_the_first_view_looks_at_its_subject_beside_the_panel(app):
    viewer = app.viewer
    controller, (width, height) = viewer.scene.controller, viewer.window.size
    middle = 0.5 * (viewer.window.panel_px + width)
    assert slider(app, "tolerance")[2] < viewer.window.panel_px < middle - 250
    subject = viewer.pointer.place_under(middle, 0.5 * height)
    assert controller.start != viewer.scene.opened.camera and controller.start.eye == viewer.scene.opened.camera.eye
    controller.pose = Pose.of(viewer.scene.opened.camera)
    assert subject == pytest.approx(viewer.pointer.place_under(0.5 * width, 0.5 * height), abs=1.0)
    viewer.settings.panel = False
    assert viewer.scene.beside_panel(viewer.scene.opened.camera) == viewer.scene.opened.camera
    down = Pose((0.0, 0.0, 100.0), 20.0, -89.9, 45.0)
    assert down.beside(300.0, 640) == down


def test_panels_of_two_apps_know_nothing_of_each_other(app, make_app):
    other = make_app()
    assert changed(seen(other), seen(app)) < 0.05  # the graphs of times differ
    other.panels.opened["Map"] = not other.panels.opened["Map"]
    for each in (other, app):
        settle(each)
    assert changed(seen(other), seen(app)) > 0.05
    other.viewer.settings.panel = False
    before = app.viewer.painter.frame.stats["triangles"]
    app.viewer.settings.loosen(2)
    settle(app)
    assert app.viewer.painter.frame.stats["triangles"] < before and app.viewer.settings.panel


def test_a_slider_is_dragged_and_the_mesh_follows(app):
    before = app.viewer.painter.frame.stats["triangles"]
    left, top, right, bottom = slider(app, "tolerance")
    middle = (top + bottom) / 2
    assert app.gui.covers(left, middle) and not app.gui.covers(700, 400)
    drag(app, ((left + right) / 2, middle), (left + 0.8 * (right - left), middle))
    assert app.viewer.settings.options.max_error_px > 10
    assert app.viewer.painter.frame.stats["triangles"] < before
    assert app.viewer.painter.frame.stats["requested_max_error_px"] == app.viewer.settings.options.max_error_px


def test_a_window_that_appears_does_not_end_the_drag_of_a_slider(app):
    left, top, right, bottom = slider(app, "tolerance")
    middle = (top + bottom) / 2
    app.gui.move(left + 0.3 * (right - left), middle)
    later(app, 0.1)
    app.gui.button("left", True)
    later(app, 0.1)
    first_px = app.viewer.settings.options.max_error_px
    app.viewer.window.say("computing light and shadow")
    for _ in range(4):
        later(app, 0.1)
    app.gui.move(left + 0.8 * (right - left), middle)
    for _ in range(2):
        later(app, 0.1)
    assert app.viewer.settings.options.max_error_px > 4 * first_px
    app.gui.button("left", False)


@pytest.mark.slow
def test_a_box_is_ticked_and_a_choice_made(app):
    app.viewer.window.resize((600, 640))
    settle(app)
    for label in ("colours", "metric", "method"):
        left, top, right, bottom = slider(app, label)
        drag(app, (left + 20, (top + bottom) / 2), (left + 20, (top + bottom) / 2))
        height = bottom - top
        place = left + 20, bottom + 1.6 * height  # the second of the list that came down
        drag(app, place, place)
    drawing = app.viewer.settings.options
    assert (drawing.style, drawing.metric, drawing.method) == (list(legend.COLOURS)[1], METRICS[1], METHODS[1])


@pytest.mark.slow
def test_a_view_is_chosen_and_travelled_to(app):
    app.panels.opened |= {"Camera": True, "Detail": False, "Understand": False}
    controller = app.viewer.scene.controller
    controller.pose = Pose((100.0, 200.0, 900.0), 77.0, -20.0, 45.0)
    settle(app)
    left, top, right, bottom = slider(app, "view")
    drag(app, *[(left + 20, (top + bottom) / 2)] * 2)
    drag(app, *[(left + 20, bottom + 2.6 * (bottom - top))] * 2)  # the third of the list
    settle(app)
    assert controller.elevation_deg < -89 and controller.eye[:2] == pytest.approx([640, 640], abs=2)
    assert controller.eye[2] > 1000 and not controller.moving


def test_files_shown_before_are_offered(app, tmp_path, monkeypatch):
    paths = [str(tmp_path / name) for name in ("one.npy", "two.npy", "gone.npy")]
    for path in paths[:2]:
        np.save(path, np.add.outer(np.arange(40.0), np.arange(30.0)))
    memory, pose = app.viewer.memory, app.viewer.scene.controller.pose
    for path in (*paths, "canyon"):
        memory.note_map(path, pose, {}, "auto")
    assert memory.recent() == [paths[1], paths[0]] and memory.recent(paths[1]) == [paths[0]]
    app.panels.opened |= {"Map": True, "Detail": False, "Understand": False}
    settle(app)
    left, top, right, bottom = slider(app, "recent")
    drag(app, *[(left + 20, (top + bottom) / 2)] * 2)
    drag(app, *[(left + 20, bottom + 1.6 * (bottom - top))] * 2)
    settle(app)
    assert app.viewer.painter.frame.name == "two.npy"


def test_esc_closes_a_list_and_nothing_else(app):
    left, top, right, bottom = slider(app, "metric")
    at = left + 20, (top + bottom) / 2
    drag(app, at, at)
    settle(app)
    assert app.gui.covers(890, 600)  # whatever is clicked next belongs to the list
    app.press("escape")
    settle(app)
    assert not app.viewer.window.closing and not app.gui.covers(890, 600)


def test_one_esc_too_many_does_not_quit(app):
    app.press("escape")
    assert not app.viewer.window.closing and "Esc again" in texts(app)
    later(app, 10.0)  # the message ends: so does the question
    app.press("escape")
    assert not app.viewer.window.closing
    app.press("escape")
    assert app.viewer.window.closing


def test_a_path_is_typed(app, tmp_path):
    np.save(tmp_path / "slope.npy", np.add.outer(np.arange(40.0), np.arange(30.0)))
    app.panels.opened |= {"Map": True, "Understand": False}
    settle(app)
    left, top, right, bottom = app.gui.widgets.places["file"]
    middle = left + 20, (top + bottom) / 2
    drag(app, middle, middle)
    assert app.gui.takes_text and app.gui.widgets.at(*middle) == "file"
    for character in str(tmp_path / "slope.npy"):
        app.gui.write(ord(character))
    settle(app)
    app.gui.key("enter", True)
    app.gui.key("enter", False)
    settle(app)
    assert app.viewer.painter.frame.name == "slope.npy" and app.viewer.settings.options.style == "lambert"


def test_every_control_has_a_line_of_help(app):
    for title in app.panels.opened:
        app.panels.opened[title] = True
    settle(app)
    assert len(app.gui.widgets.places) > 20
    silent = [label for label, text in app.gui.widgets.hints.items() if not 10 < len(text) < 160]
    assert silent == [] and set(app.gui.widgets.hints) == set(app.gui.widgets.places)


def test_the_error_is_measured_and_drawn(app):
    records = app.viewer.painter.history.records
    assert records[-1].measured_px is not None and records[-1].measured_px <= records[-1].bound_px
    app.viewer.settings.loosen(2)
    settle(app)
    assert len(records) >= 2 and records[-1].triangles < records[0].triangles
    assert records[0].measured_px < records[-1].measured_px <= records[-1].bound_px <= 2


def test_the_largest_error_is_shown_before_all_places_are_measured(app):
    painter = app.viewer.painter
    set_budget(app.viewer, slow())  # one step in a frame
    app.viewer.settings.loosen(1 / 16)
    later(app)
    for _ in range(10_000):
        if painter.drawn and painter.frame.measured_px:
            break
        later(app)
    sooner = painter.frame.achieved_px
    assert not painter.is_measured and painter.waits_for_rest
    assert error_words(painter.frame) == f"so far {sooner:.3f} px, bound {painter.frame.certified_px:.3f} px"
    settle(app)
    assert painter.is_measured and painter.frame.measured_px.keys() == {"max", "rms"}
    assert error_words(painter.frame) == f"achieved {sooner:.3f} px, bound {painter.frame.certified_px:.3f} px"
    assert painter.frame.achieved_px == sooner


def test_exaggeration_raises_the_land_and_the_bound_holds(app):
    heights, eye = app.viewer.scene.renderer.heightmap.heights.copy(), app.viewer.scene.controller.pose.eye
    for factor in (2.5, 1.0):
        app.viewer.exaggerate(factor)
        settle(app)
        assert np.array_equal(app.viewer.scene.heightmap.heights, heights)
        assert app.viewer.scene.controller.pose.eye[2] == pytest.approx(eye[2] * factor)
        assert app.viewer.painter.frame.measured_px["max"] <= 1


def test_panels_are_larger_on_a_fine_screen(app):
    before = slider(app, "tolerance")
    app.press("ctrl+=")
    settle(app)
    after = slider(app, "tolerance")
    assert (after[3] - after[1]) == pytest.approx(UI_STEP * (before[3] - before[1]), rel=0.1)
    for _ in range(20):
        app.press("ctrl++")
    settle(app)
    largest = slider(app, "tolerance")
    assert (
        largest[2] - largest[0] > after[2] - after[0] and app.viewer.window.panel_px < 0.5 * app.viewer.window.size[0]
    )
    app.press("ctrl+-")
    assert app.viewer.settings.ui_scale < UI_SCALES[1]
    assert scale_of((3840, 2160), 1.0, 1.0) == 2.0 and scale_of((1280, 720), 1.5, 1.0) == 1.5
    assert scale_of((800, 500), 1.0, 1.0) == 1.0


def test_the_help_page_has_every_key(app):
    app.press("h")
    settle(app)
    shown = texts(app)
    assert all(keys in shown and meaning in shown for _, keys, meaning in shown_lines())
    assert app.gui.covers(450, 320)
    with_help = seen(app)
    app.press("escape")
    settle(app)
    assert changed(seen(app), with_help) > 0.2


@pytest.mark.slow
def test_the_help_page_is_read_to_its_end_in_a_small_window(app):
    app.press("i")
    app.viewer.window.resize((400, 260))
    app.press("h")
    settle(app)
    top = seen(app)
    app.gui.move(200, 150)
    for _ in range(100):
        app.gui.wheel(0, -5)
        settle(app)
    bottom = seen(app)
    assert changed(bottom, top) > 0.05
    app.gui.wheel(0, -5)
    settle(app)
    assert np.array_equal(seen(app), bottom)  # there is an end


@pytest.mark.parametrize("size", [(1000, 600), (1280, 720)])
def test_the_help_page_fits_a_window_of_usual_size(make_app, size):
    app = make_app(size)
    app.press("h")
    settle(app)
    shown = seen(app)
    app.gui.move(round(0.65 * size[0]), size[1] // 2)
    app.gui.wheel(0, -5)
    settle(app)
    assert np.array_equal(seen(app), shown)


def test_without_imgui_bundle_one_line_says_so(monkeypatch):
    monkeypatch.setitem(sys.modules, "imgui_bundle", None)
    with pytest.raises(TerrainError, match=r"pip install 'terrain-gl\[gui\]'") as error:
        run(hills())
    assert "\n" not in str(error.value)


def overlaps(app):
    """Pairs of windows that overlap; the picture of the summed-area table counts as one."""
    for _ in range(3):  # a window knows its size after a frame
        later(app, 0.0)
    boxes = listen(app).windows
    if app.viewer.settings.sums and not app.viewer.settings.help:
        height, (left, bottom, across, up) = app.viewer.window.size[1], app.viewer.sums_frame
        boxes.append(("sums", left, height - bottom - up, left + across, height - bottom))
    pairs = itertools.combinations(boxes, 2)
    return [
        (a[0], b[0])
        for a, b in pairs
        if max(a[1], b[1]) < min(a[3], b[3]) - 0.5 and max(a[2], b[2]) < min(a[4], b[4]) - 0.5
    ]


@pytest.mark.slow
@pytest.mark.parametrize("size", [(1000, 600), (1280, 800)])
def test_nothing_overlaps(make_app, size):
    app = make_app(size)
    viewer, place = app.viewer, (0.7 * size[0], 0.75 * size[1])
    app.panels.opened = dict.fromkeys(app.panels.opened, True)
    settle(app)
    assert overlaps(app) == []
    viewer.explainer.explain(*place)
    viewer.window.say("a long message, such as the path of a file that was saved and how to open it again " * 3)
    viewer.loader.load("endless", lambda progress: time.sleep(1) or 1 / 0)  # its bar is shown meanwhile
    assert overlaps(app) == [] and viewer.explainer.explanation and viewer.progress
    app.press("escape")
    app.press("escape")
    for keys in (["t", "u"], ["h"], ["h", "b", "ctrl+s"]):
        for key in keys:
            app.press(key)
        viewer.mouse.move(*place)
        settle(app)
        assert overlaps(app) == [], keys


@pytest.mark.slow
def test_contour_lines_keep_their_heights_in_exaggerated_land(app):
    app.panels.opened |= {"Picture": True, "Detail": False, "Understand": False}
    before = seen(app)
    app.press("shift+c")
    settle(app)
    assert 0.005 < changed(seen(app), before) < 0.3
    app.viewer.exaggerate(2.0)
    settle(app)
    renderer = app.viewer.scene.renderer
    drawn = renderer.picture.places()[0]
    labels = renderer.contour_labels(0.0)
    assert len(labels) > 2
    for name, x, y, _ in labels:
        col, row = drawn[int(y), int(x)]
        x_m, y_m = 10 * col, 10 * (128 - row)
        assert renderer.height_at(x_m, y_m) == pytest.approx(float(name.removesuffix(" m")), abs=3.0)
    app.press("shift+c")
    assert app.viewer.scene.frame_spec().sides[0].contour_m is None
