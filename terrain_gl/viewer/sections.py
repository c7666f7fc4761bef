"""Sections of the panel: detail, understanding, sculpting, camera, saving."""

import math
from typing import Any, cast

import numpy as np

from ..files.export import FORMATS
from ..files.views import VIEWS, straight_down
from ..pages.terrain import PagedTerrain
from ..renderer.brush import SHARES, TOOLS
from ..renderer.methods import BASELINES, REGISTRY
from ..renderer.options import CHOICES
from . import tile_map
from .brush_tool import BrushTool
from .controller import MODES
from .legend import COLOURS
from .overview import Overview
from .pose import Pose
from .saver import SIZES
from .settings import BUDGETS, TOLERANCES_PX
from .tour import REST_S
from .viewer import Viewer
from .widgets import PATH, Widgets

TOLERANCE_HINTS = {
    "max": "The largest error of the surface on the screen (+ and -).",
    "rms": "The root mean square of the errors of all drawn land in the picture (+ and -).",
}
BASELINE_HINT = "The error that this method aims at; it has no certified bound (+ and -)."
BUDGET_HINTS = {
    "max": "At most so many triangles, for the smallest largest error. Changing the tolerance ends it.",
    "rms": "At most so many triangles, for the least squared errors. Changing the tolerance ends it.",
}
METRIC_HINT = "What the tolerance bounds, or the budget minimises (M): the largest error, or the RMS of all."
SAVE_MAP = "Save the map", "As 16-bit PNG, float TIFF or EXR: the ending of the name decides (Ctrl S)."
SAVE_EDITS = "Save the edits", "As GeoTIFF, or as .npz: the store stays as it is (Ctrl S)."
PRESETS = {"first": VIEWS["default"], "above": straight_down} | {n: view for n, view in VIEWS.items() if n != "default"}


def detail_section(ui: Widgets, viewer: Viewer) -> None:
    """Build the section on the detail of the mesh."""
    settings = viewer.settings
    options = settings.options
    if settings.split:
        where = "right" if viewer.scene.split.is_right(settings.active) else "left"
        ui.imgui.text_disabled(f"of the {where} side; point at a side to choose it")
    stats = [*viewer.painter.side_stats, viewer.painter.frame.stats][settings.active]  # a new side has no stats yet
    tolerance_px = options.max_error_px or stats.get("certified_max_error_px") or 1.0
    triangles = options.triangles or stats.get("triangles", 1)
    before = {"max_error_px": tolerance_px, "metric": options.metric, "triangles": triangles, "method": options.method}
    now: dict[str, Any] = {}
    hint = BASELINE_HINT if options.method in BASELINES else TOLERANCE_HINTS[options.metric]
    now["max_error_px"] = ui.slide("tolerance", tolerance_px, TOLERANCES_PX, hint, "%.3g px", True)
    now["metric"] = ui.choose("metric", options.metric, CHOICES["metric"], METRIC_HINT)
    form = "at most %.0f" if options.triangles else "%.0f"
    now["triangles"] = round(ui.slide("triangles", triangles, BUDGETS, BUDGET_HINTS[options.metric], form, True))
    if viewer.scene.is_paged:
        ui.imgui.text_disabled("A store is drawn by the method sat.")
        tile_map.show(ui, cast(PagedTerrain, viewer.scene.renderer.terrain), viewer.scene.controller)
    else:
        hint = f"How detail is chosen (F). {options.method}: {REGISTRY[options.method].help}."
        now["method"] = ui.choose("method", options.method, CHOICES["method"], hint)
    if changes := {name: value for name, value in now.items() if value != before[name]}:
        settings.change(**changes)


def understand_section(ui: Widgets, viewer: Viewer) -> None:
    """Build the section on how detail is chosen."""
    settings = viewer.settings
    style = settings.options.style
    colours = COLOURS if style in COLOURS else COLOURS | {style: style}
    chosen = ui.choose("colours", colours[style], list(colours.values()), "What the colours of the land show.")
    if chosen != colours[style]:
        settings.change(style=next(style for style, words in colours.items() if words == chosen))
    if shown := viewer.legend(settings.active):
        ui.legend(shown)
    ui.tick("mesh over the picture", settings.options.wires, "The edges of all triangles, over any style (N).", "n")
    hint = "The levels stay as they were chosen for this camera. Fly around and look at them (L)."
    ui.tick("freeze the levels", viewer.scene.frozen is not None, hint, "l")
    ui.tick("split the picture", settings.split, "Two methods or settings side by side (T).", "t")
    if settings.split:
        hint = "Each side shows the middle of its picture (Ctrl T). Shift T swaps the sides."
        ui.tick("same land on both sides", settings.centred, hint, "ctrl+t")
    ui.tick("magnifying glass", settings.lens > 0, "Shows pixels as squares under the cursor (Z).", "z")
    if settings.lens:
        settings.lens = ui.slide("magnification", settings.lens, (2.0, 16.0), "Of the magnifying glass.", "× %.0f")
    ui.tick("summed-area table", settings.sums, "The sum of any box is read at its four corners (U).", "u")
    if settings.sums:
        hint = "Posts along a side of the box under the cursor."
        settings.box = round(ui.slide("box", settings.box, (2, 256), hint, "%.0f posts"))
    sculpts = viewer.sculpting.brushing
    ui.imgui.text_disabled(
        "A click sculpts; B puts the brush away." if sculpts else "Click on the land to see why it is drawn so."
    )


def layers_section(ui: Widgets, viewer: Viewer) -> None:
    """Build the list of layers, the first one at the bottom."""
    imgui = ui.imgui
    layers = viewer.layers
    hint = "GPX, KML, GeoJSON, or a photo of the ground (JPEG). Or drop files on the window."
    if path := ui.enter("add", "", PATH, hint):
        viewer.open(path)
    for i, layer in enumerate(list(layers.layers)):
        imgui.push_id(i)
        if ui.tick(f"##{i}", layer.is_shown, f"Show {layer.name}, or hide it; saved pictures and films follow."):
            layers.toggle(layer)
        if not layer.is_image:
            imgui.same_line()
            colour = [each / 255 for each in layer.colour[:3]]
            chosen, now = imgui.color_edit3("##colour", colour, imgui.ColorEditFlags_.no_inputs)
            ui.hint(f"colour {i}", f"The colour of {layer.name}.")
            if chosen:
                red, green, blue = (round(255 * each) for each in now)
                layers.paint(layer, (red, green, blue, 255))
        for label, hint, act in (
            ("-", "Draw it before the layer above this line.", layers.lower),
            ("x", "Take it away.", layers.remove),
        ):
            imgui.same_line()
            if ui.button(label, f"{layer.name}: {hint}"):
                act(layer)
        imgui.same_line()
        imgui.text(layer.name)
        imgui.pop_id()
    if not layers.layers:
        imgui.text_disabled("Drop tracks, outlines or a photo on the window.")


def lecture_section(ui: Widgets, viewer: Viewer) -> None:
    """Build the list of a lecture's stations."""
    lecture = viewer.lecture
    number = lecture.number if lecture else None
    label = "End the lecture" if number is not None else "Go on" if lecture else "Begin the lecture"
    ui.button(label, "Stations on how detail is chosen, with large type (Ctrl L).", "ctrl+l")
    for i, station in enumerate(lecture.stations if lecture else ()):
        if ui.imgui.selectable(f"{i + 1}  {station.name}", i == number)[0] and lecture:
            lecture.go_to(i)
        ui.hint(station.name, station.sees or "Go to this station.")


def sculpt_section(ui: Widgets, viewer: Viewer) -> None:
    """Build the section on the brush."""
    tool = viewer.sculpting.tool
    if tool is None:
        ui.imgui.text_disabled("Ready when the tables are built.")
        return
    hint = "Drag on the land to change it. The certified bound holds during a stroke (B)."
    ui.tick("brush", viewer.sculpting.brushing, hint, "b")
    tool.tool = ui.choose("tool", tool.tool, TOOLS, "What the brush does (X).")
    _brush_sliders(ui, tool)
    undone, redone = tool.strokes
    ui.button("Undo", f"Undo the last of {undone} strokes (Ctrl Z).", "ctrl+z", undone > 0)
    ui.imgui.same_line()
    ui.button("Redo", f"Redo the last of {redone} undone strokes (Ctrl Shift Z).", "ctrl+shift+z", redone > 0)
    ui.imgui.same_line()
    ui.button(*(SAVE_EDITS if viewer.scene.is_paged else SAVE_MAP), "ctrl+s")
    if (streaming := viewer.scene.renderer.streaming) and streaming.is_wide:
        ui.imgui.text_disabled("Bounds are wider until the edits are measured.")


def _brush_sliders(ui: Widgets, tool: BrushTool) -> None:
    heightmap = tool.renderer.heightmap
    least, most = min(heightmap.spacing_m), min(0.5 * max(heightmap.extent_m), tool.most_radius_m)
    hint = "Radius of the ring on the land ([ and ])."
    tool.radius_m = ui.slide("radius", tool.radius_m, (least, most), hint, metres_form(tool.radius_m), True)
    if tool.tool in SHARES:
        tool.share = ui.slide("strength", tool.share, (0.01, 1.0), "How far a dab goes (keys , and .).")
    else:
        relief = max(heightmap.range_m[1] - heightmap.range_m[0], 1.0)
        form = metres_form(tool.strength_m)
        hint = "Metres by which a dab moves the middle of the ring (keys , and .)."
        tool.strength_m = ui.slide("strength", tool.strength_m, (1e-4 * relief, 0.5 * relief), hint, form, True)
    if tool.tool == "cliff":
        hint = "The direction that the cliff faces, clockwise from north."
        tool.azimuth_deg = ui.slide("face", tool.azimuth_deg, (0.0, 360.0), hint, "%.0f°")


def metres_form(metres: float) -> str:
    """The format of a slider's metres: never with powers of ten."""
    return "%.0f m" if metres >= 100 else "%.3g m"


class CameraSection:
    """The section on the camera, with its small map."""

    def __init__(self) -> None:
        self._overview = Overview()

    def show(self, ui: Widgets, viewer: Viewer) -> None:
        _camera(ui, viewer)
        scene = viewer.scene
        version = None if viewer.sculpting.at_work else (scene.renderer, scene.renderer.terrain.edits)
        place = self._overview.show(ui, scene.controller, scene.heightmap, viewer.window.size, version)
        if place is not None and np.isfinite(place).all():
            viewer.travel_above(place)


def _camera(ui: Widgets, viewer: Viewer) -> None:
    scene = viewer.scene
    controller = scene.controller
    names = ("fly to a view", *PRESETS)
    if (name := ui.choose("view", names[0], names, "Standard views of the map; the camera travels there.")) in PRESETS:
        view = scene.of_view(PRESETS[name](controller.heightmap.coarse(), controller.fov_deg))
        controller.travel_to(Pose.of(scene.beside_panel(view)))
    hint = "Coordinates as at the lower right, highest, largest error, or a name of an overlay."
    if typed := ui.enter("go to", "", "a place, then Enter", hint):
        viewer.go_to(typed)
    mode = ui.choose("mode", controller.mode, MODES, "Fly anywhere, orbit the middle, walk at eye height (V).")
    if mode != controller.mode:
        controller.change_mode(mode)
    extent = max(controller.heightmap.extent_m)
    form = metres_form(controller.speed_m_s) + "/s"
    hint = "Speed of W A S D (Shift wheel). It grows with the height above ground."
    speed_m_s = ui.slide("speed", controller.speed_m_s, (1e-5 * extent, extent), hint, form, True)
    if speed_m_s != controller.speed_m_s:
        controller.speed_m_s = speed_m_s
    hint = "Vertical angle (Ctrl wheel)."
    controller.fov_deg = ui.slide("field of view", controller.fov_deg, (1.0, 120.0), hint, "%.0f°")
    ui.tick("stay above ground", controller.above_ground, "Keep the camera above the land (G).", "g")
    hint = f"After {REST_S / 60:g} minutes without input, the camera turns around the land; any key ends that."
    if ui.tick("tour at rest", viewer.tour.after_s == REST_S, hint):
        viewer.tour.after_s = math.inf if viewer.tour.after_s == REST_S else REST_S
    ui.button("Home", "Back to the first view (Home).", "home")
    ui.imgui.text_disabled("Bookmarks: + sets one; its number travels there.")
    for number in range(1, 10):
        if number > 1:
            ui.imgui.same_line()
        if number in scene.bookmarks:
            ui.button(str(number), f"Travel to bookmark {number} (key {number}).", str(number))
        else:
            ui.button(f"+##{number}", f"Set bookmark {number} here (Ctrl {number}).", f"ctrl+{number}")


def save_section(ui: Widgets, viewer: Viewer) -> None:
    """Build the section on saving."""
    saver = viewer.saver
    saver.size = ui.choose("size", saver.size, list(SIZES), "Size of saved pictures; it does not depend on the window.")
    ui.button("Save the picture", "As PNG in the working directory, with its numbers as JSON beside it (P).", "p")
    recording = "Stop recording" if saver.filming.running else "Record a film"
    ui.button(recording, "Record the flight; then its film is drawn in full quality, at this size (R).", "r")
    ui.button(
        "Film a turn", "Once around the land in the middle of the picture; you can go on flying (Ctrl R).", "ctrl+r"
    )
    ui.imgui.same_line()
    ui.button("Film a day", "This view from sunrise to sunset; you can go on flying (Ctrl D).", "ctrl+d")
    ui.button("Copy the command line", "The terrain-gl shot command that draws this picture (Y).", "y")
    saver.mesh_format = ui.choose("format", saver.mesh_format, list(FORMATS), "Format of meshes.")
    ui.button("Save the mesh", "The triangles that are drawn, in metres; .stl: in mm (O).", "o")
    hint = "The bookmarks as a camera path; terrain-gl fly makes a film of it (K)."
    ui.button("Save the camera path", hint, "k", len(viewer.scene.bookmarks) > 1)
