"""Sections of the panel: detail, understanding, sculpting, camera, saving."""

from collections.abc import Callable
from typing import Any, cast

from ..files.export import FORMATS
from ..files.views import VIEWS, straight_down
from ..pages.terrain import PagedTerrain
from ..renderer.brush import SHARES, TOOLS
from ..renderer.methods import BASELINES, REGISTRY
from ..renderer.options import CHOICES
from . import tile_map
from .brush_tool import BrushTool
from .controller import MODES
from .legend import COLOURS, legend
from .painter import Painter
from .pose import Pose
from .saver import SIZES, Saver
from .scene import Scene
from .sculpting import Sculpting
from .settings import BUDGETS, TOLERANCES_PX, Settings
from .widgets import Widgets

Press = Callable[[str], None]  # executes the command of a key
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


def detail_section(ui: Widgets, settings: Settings, painter: Painter, scene: Scene) -> None:
    """Build the section on the detail of the mesh."""
    options = settings.options
    if settings.split:
        ui.imgui.text_disabled(f"of the {('left', 'right')[settings.active]} side; point at a side to choose it")
    stats = [*painter.side_stats, painter.frame.stats][settings.active]  # a new side has no stats yet
    tolerance_px = options.max_error_px or stats.get("certified_max_error_px") or 1.0
    hint = BASELINE_HINT if options.method in BASELINES else TOLERANCE_HINTS[options.metric]
    changes: dict[str, Any] = {}
    changes["max_error_px"] = ui.slide("tolerance", tolerance_px, *TOLERANCES_PX, hint, "%.3g px", True)
    changes["metric"] = ui.choose("metric", options.metric, CHOICES["metric"], METRIC_HINT)
    triangles = options.triangles or stats.get("triangles", 1)
    form = "at most %.0f" if options.triangles else "%.0f"
    budget = ui.slide("triangles", triangles, *BUDGETS, BUDGET_HINTS[options.metric], form, True)
    changes["triangles"] = None if budget is None else round(budget)
    if scene.is_paged:
        ui.imgui.text_disabled("A store is drawn by the method sat.")
        tile_map.show(ui, cast(PagedTerrain, scene.renderer.terrain), scene.controller)
    else:
        hint = f"How detail is chosen (F). {options.method}: {REGISTRY[options.method].help}."
        changes["method"] = ui.choose("method", options.method, CHOICES["method"], hint)
    given = {name: value for name, value in changes.items() if value is not None}
    if given:
        settings.change(**given)


def understand_section(ui: Widgets, scene: Scene, sculpts: bool, press: Press) -> None:
    """Build the section on how detail is chosen."""
    settings = scene.settings
    style = settings.options.style
    colours = COLOURS if style in COLOURS else COLOURS | {style: style}
    chosen = ui.choose("colours", colours[style], list(colours.values()), "What the colours of the land show.")
    if chosen:
        settings.change(style=next(style for style, words in colours.items() if words == chosen))
    if (shown := legend(settings.options)) and not scene.is_preview:
        ui.legend(shown)
    if ui.tick("mesh over the picture", settings.options.wires, "The edges of all triangles, over any style (N)."):
        press("n")
    hint = "The levels stay as they were chosen for this camera. Fly around and look at them (L)."
    if ui.tick("freeze the levels", scene.frozen is not None, hint):
        press("l")
    if ui.tick("split the picture", settings.split, "Two methods or settings side by side (T)."):
        press("t")
    if ui.tick("magnifying glass", settings.lens > 0, "Shows pixels as squares under the cursor (Z)."):
        press("z")
    if settings.lens:
        lens = ui.slide("magnification", settings.lens, 2.0, 16.0, "Of the magnifying glass.", "× %.0f")
        settings.lens = settings.lens if lens is None else lens
    if ui.tick("summed-area table", settings.sums, "The sum of any box is read at its four corners (U)."):
        press("u")
    if settings.sums:
        side = ui.slide("box", settings.box, 2, 256, "Posts along a side of the box under the cursor.", "%.0f posts")
        settings.box = settings.box if side is None else round(side)
    sentence = "A click sculpts; B puts the brush away." if sculpts else "Click on the land to see why it is drawn so."
    ui.imgui.text_disabled(sentence)


def sculpt_section(ui: Widgets, scene: Scene, sculpting: Sculpting, press: Press) -> None:
    """Build the section on the brush."""
    tool = sculpting.tool
    if tool is None:
        ui.imgui.text_disabled("Ready when the tables are built.")
        return
    hint = "Drag on the land to change it. The certified bound holds during a stroke (B)."
    if ui.tick("brush", sculpting.brushing, hint):
        press("b")
    tool.tool = ui.choose("tool", tool.tool, TOOLS, "What the brush does (X).") or tool.tool
    _brush_sliders(ui, tool)
    undone, redone = tool.strokes
    if ui.button("Undo", f"Undo the last of {undone} strokes (Ctrl Z).", undone > 0):
        press("ctrl+z")
    ui.imgui.same_line()
    if ui.button("Redo", f"Redo the last of {redone} undone strokes (Ctrl Shift Z).", redone > 0):
        press("ctrl+shift+z")
    ui.imgui.same_line()
    name, hint = SAVE_EDITS if scene.is_paged else SAVE_MAP
    if ui.button(name, hint):
        press("ctrl+s")
    if (streaming := scene.renderer.streaming) and streaming.is_wide:
        ui.imgui.text_disabled("Bounds are wider until the edits are measured.")


def _brush_sliders(ui: Widgets, tool: BrushTool) -> None:
    heightmap = tool.renderer.heightmap
    least, most = min(heightmap.spacing_m), min(0.5 * max(heightmap.extent_m), tool.most_radius_m)
    hint = "Radius of the ring on the land ([ and ])."
    radius = ui.slide("radius", tool.radius_m, least, most, hint, metres_form(tool.radius_m), True)
    tool.radius_m = tool.radius_m if radius is None else radius
    if tool.tool in SHARES:
        share = ui.slide("strength", tool.share, 0.01, 1.0, "How far a dab goes (, and .).", "%.2f")
        tool.share = tool.share if share is None else share
    else:
        relief = max(heightmap.range_m[1] - heightmap.range_m[0], 1.0)
        form = metres_form(tool.strength_m)
        hint = "Metres by which a dab moves the middle of the ring (, and .)."
        strength = ui.slide("strength", tool.strength_m, 1e-4 * relief, 0.5 * relief, hint, form, True)
        tool.strength_m = tool.strength_m if strength is None else strength
    if tool.tool == "cliff":
        hint = "The direction that the cliff faces, clockwise from north."
        azimuth = ui.slide("face", tool.azimuth_deg, 0.0, 360.0, hint, "%.0f°")
        tool.azimuth_deg = tool.azimuth_deg if azimuth is None else azimuth


def metres_form(metres: float) -> str:
    """The format of a slider's metres: never with powers of ten."""
    return "%.0f m" if metres >= 100 else "%.3g m"


def camera_section(ui: Widgets, scene: Scene, press: Press) -> None:
    """Build the section on the camera."""
    controller = scene.controller
    names = ("fly to a view", *PRESETS)
    if (name := ui.choose("view", names[0], names, "Standard views of the map; the camera travels there.")) in PRESETS:
        seen = controller.heightmap
        view = scene.of_view(PRESETS[name](seen.coarse(), controller.fov_deg))
        controller.travel_to(Pose.of(scene.beside_panel(view)))
    mode = ui.choose("mode", controller.mode, MODES, "Fly anywhere, orbit the middle, walk at eye height (V).")
    if mode:
        controller.change_mode(mode)
    extent = max(controller.heightmap.extent_m)
    form = metres_form(controller.speed_m_s) + "/s"
    hint = "Speed of W A S D (Shift wheel). It grows with the height above ground."
    speed = ui.slide("speed", controller.speed_m_s, 1e-5 * extent, extent, hint, form, True)
    if speed is not None:
        controller.speed_m_s = speed
    fov = ui.slide("field of view", controller.fov_deg, 1.0, 120.0, "Vertical angle (Ctrl wheel).", "%.0f°")
    if fov is not None:
        controller.fov_deg = fov
    if ui.tick("stay above ground", controller.above_ground, "Keep the camera above the land (G)."):
        press("g")
    if ui.button("Home", "Back to the first view (Home)."):
        press("home")
    _bookmarks(ui, scene, press)


def _bookmarks(ui: Widgets, scene: Scene, press: Press) -> None:
    ui.imgui.text_disabled("Bookmarks: + sets one; its number travels there.")
    for number in range(1, 10):
        if number > 1:
            ui.imgui.same_line()
        if number in scene.bookmarks:
            if ui.button(str(number), f"Travel to bookmark {number} (key {number})."):
                press(str(number))
        elif ui.button(f"+##{number}", f"Set bookmark {number} here (Ctrl {number})."):
            press(f"ctrl+{number}")


def save_section(ui: Widgets, saver: Saver, scene: Scene, press: Press) -> None:
    """Build the section on saving."""
    hint = "Size of saved pictures; it does not depend on the window."
    saver.size = ui.choose("size", saver.size, list(SIZES), hint) or saver.size
    if ui.button("Save the picture", "As PNG in the working directory, with its numbers as JSON beside it (P)."):
        press("p")
    recording = "Stop recording" if saver.filming.running else "Record a film"
    if ui.button(recording, "Record the flight; then its film is drawn in full quality, at this size (R)."):
        press("r")
    if ui.button("Copy the command line", "The terrain-gl shot command that draws this picture (Y)."):
        press("y")
    saver.mesh_format = ui.choose("format", saver.mesh_format, list(FORMATS), "Format of meshes.") or saver.mesh_format
    if ui.button("Save the mesh", "The triangles that are drawn, in metres (O)."):
        press("o")
    hint = "The bookmarks as a camera path; terrain-gl fly makes a film of it (K)."
    if ui.button("Save the camera path", hint, len(scene.bookmarks) > 1):
        press("k")
