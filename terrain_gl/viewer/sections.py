"""The panel's sections: controls on the left, and what they change in the flight on the right."""

from __future__ import annotations

from datetime import datetime
from typing import TYPE_CHECKING, Any

from ..brush import SHARES, TOOLS
from ..drawing import CHOICES
from ..export import FORMATS
from ..light.sun import sun_position
from ..maps import bundled
from ..methods.rivals import RIVALS
from .controller import MODES
from .keeping import SIZES
from .legend import COLOURS, legend
from .settings import BUDGETS, TOLERANCES_PX

if TYPE_CHECKING:
    from .flight import Flight
    from .gui import Gui

_LATITUDE_DEG = 46.0  # of the sun's course through the day
_DAY = datetime(2025, 8, 1)
METHODS_HELP = "How detail is chosen (F): sat keeps the promise with few triangles; full draws every post."
TOLERANCE_HELP = {
    "max": "No post is drawn further than this from its place in the picture (+ and -).",
    "rms": "What posts are off their places in the picture, as root mean square, is at most this (+ and -).",
}
AIM_HELP = "What this method aims at, for it promises nothing (+ and -)."
BUDGET_HELP = "At most so many, where they take away most error; moving the tolerance ends it."
METRIC_HELP = "What the tolerance bounds (M): the largest error of any post, or the root mean square of all."


def land(gui: Gui, flight: Flight) -> None:
    """Which map is seen."""
    key = flight.land.opened.key
    names = [*bundled(), *([] if key in bundled() else [flight.figures.name])]
    now = key if key in bundled() else flight.figures.name
    if name := gui.choose("map", now, names, "Maps that come with the program."):
        flight.land.open(name)
    if path := gui.enter(
        "file", flight.land.refused, "PNG, TIFF, EXR, HDR, NPY or HGT. You can drop a file on the window as well."
    ):
        flight.land.open(path)
    spacing = flight.land.opened.heightmap.spacing_m
    words = f"{spacing[0]:g}" if spacing[0] == spacing[1] else f"{spacing[0]:g} × {spacing[1]:g}"
    if typed := gui.enter(
        "spacing", words, "Metres between posts, then Enter: for maps that do not tell, or tell wrongly."
    ):
        flight.space(typed)


def detail(gui: Gui, flight: Flight) -> None:
    """How fine the mesh is."""
    settings, drawing = flight.settings, flight.settings.drawing
    if settings.split:
        gui.imgui.text_disabled(f"of the {('left', 'right')[settings.active]} side; the cursor chooses")
    stats = [*flight.painter.side_stats, flight.figures.stats][settings.active]  # a side may have come just now
    tolerance_px = drawing.max_error_px or stats.get("certified_max_error_px") or 1.0
    text = AIM_HELP if drawing.method in RIVALS else TOLERANCE_HELP[drawing.metric]
    changes: dict[str, Any] = {
        "max_error_px": gui.slide("tolerance", tolerance_px, *TOLERANCES_PX, text, "%.3g px", True),
        "triangles": gui.slide(
            "triangles",
            drawing.triangles or stats.get("triangles", 1),
            *BUDGETS,
            BUDGET_HELP,
            "at most %.0f" if drawing.triangles else "%.0f",
            True,
        ),
        "metric": gui.choose("metric", drawing.metric, CHOICES["metric"], METRIC_HELP),
        "method": gui.choose("method", drawing.method, CHOICES["method"], METHODS_HELP),
    }
    if changes["triangles"] is not None:
        changes["triangles"] = round(changes["triangles"])
    _apply(settings, changes)


def _of_metres(metres: float) -> str:
    """How a slider writes metres: never as powers of ten where they are many."""
    return "%.0f m" if metres >= 100 else "%.3g m"


def understand(gui: Gui, flight: Flight) -> None:
    """How detail comes about."""
    settings = flight.settings
    styles = {**COLOURS, **({} if (style := settings.drawing.style) in COLOURS else {style: style})}
    told = gui.choose("colours", styles[style], list(styles.values()), "What the land's colours tell.")
    if told:
        settings.draw(style=next(style for style, words in styles.items() if words == told))
    if shown := legend(settings.drawing):
        gui.show_legend(shown)
    if gui.tick("mesh over the picture", settings.drawing.wires, "The edges of all triangles, over any style (N)."):
        flight.press("n")
    frozen = flight.insight.frozen is not None
    if gui.tick(
        "freeze the levels", frozen, "Detail stays as it is for this eye, also out of its sight; fly around (L)."
    ):
        flight.press("l")
    if gui.tick("split the picture", settings.split, "Two methods or settings side by side (T)."):
        flight.press("t")
    if gui.tick("magnifying glass", settings.lens > 0, "Pixels as squares under the cursor (Z)."):
        flight.press("z")
    if settings.lens:
        lens = gui.slide("times larger", settings.lens, 2.0, 16.0, "How strong the glass is.", "× %.0f")
        settings.lens = settings.lens if lens is None else lens
    if gui.tick("summed-area table", settings.sums, "What a box sum is read from, at four corners (U)."):
        flight.press("u")
    if settings.sums:
        side = gui.slide("box", settings.box, 2, 256, "Posts a side of the box under the cursor.", "%.0f posts")
        settings.box = settings.box if side is None else round(side)
    gui.imgui.text_disabled("Click on the land: why is it drawn so?")


def sculpt(gui: Gui, flight: Flight) -> None:
    """Changing the land."""
    editing = flight.sculpting.editing
    if editing is None:
        gui.imgui.text_disabled("as soon as the tables are built")
        return
    text = "Drag on the land to change it; the promise holds all the while (B)."
    if gui.tick("brush", flight.sculpting.brushing, text):
        flight.press("b")
    tool = gui.choose("tool", editing.tool, TOOLS, "What the brush does (X).")
    editing.tool = tool or editing.tool
    heightmap = editing.renderer.heightmap
    least, most = min(heightmap.spacing_m), 0.5 * max(heightmap.extent_m)
    radius = gui.slide(
        "radius",
        editing.radius_m,
        least,
        most,
        "Of the ring on the land ([ and ]).",
        _of_metres(editing.radius_m),
        True,
    )
    editing.radius_m = editing.radius_m if radius is None else radius
    if editing.tool in SHARES:
        share = gui.slide("strength", editing.share, 0.01, 1.0, "Share of the way, each dab (, and .).", "%.2f")
        editing.share = editing.share if share is None else share
    else:
        reach = max(heightmap.range_m[1] - heightmap.range_m[0], 1.0)
        text = "Metres in the middle, each dab (, and .)."
        metres = gui.slide(
            "strength", editing.strength_m, 1e-4 * reach, 0.5 * reach, text, _of_metres(editing.strength_m), True
        )
        editing.strength_m = editing.strength_m if metres is None else metres
    if editing.tool == "cliff":
        text = "Where the cliff's face looks, clockwise from north."
        azimuth = gui.slide("face", editing.azimuth_deg, 0.0, 360.0, text, "%.0f°")
        editing.azimuth_deg = editing.azimuth_deg if azimuth is None else azimuth
    undone, redone = editing.strokes
    if gui.press_button("Undo", f"Take the last of {undone} strokes back (Ctrl Z).", undone > 0):
        flight.press("ctrl+z")
    gui.imgui.same_line()
    if gui.press_button("Redo", f"Do the last of {redone} undone strokes again (Ctrl Shift Z).", redone > 0):
        flight.press("ctrl+shift+z")
    gui.imgui.same_line()
    if gui.press_button("Save the land", "As 16-bit PNG, float TIFF or EXR, by the name's ending (Ctrl S)."):
        flight.press("ctrl+s")


def picture(gui: Gui, flight: Flight) -> None:
    """How it looks."""
    settings, drawing = flight.settings, flight.settings.drawing
    _apply(settings, {"style": gui.choose("style", drawing.style, CHOICES["style"], "What the colours mean (Tab, J).")})
    _light(gui, flight)
    _water(gui, flight)
    text = "Light from an equirectangular .hdr or .exr picture; none: a clear sky. Drop a file on it, or type a path."
    if (path := gui.enter("sky image", drawing.sky or "", text)) is not None:
        flight.dressing.wear("sky", path)
    text = "The ground's colours from a picture of the map, north up; none: what heights and slopes suggest."
    if (path := gui.enter("ground image", drawing.material or "", text)) is not None:
        flight.dressing.wear("material", path)
    factor = gui.slide("exaggeration", flight.factor, 0.25, 8.0, "Heights are multiplied by this.", "× %.2f", True)
    if factor is not None:
        flight.factor = factor
    if gui.imgui.is_item_deactivated_after_edit():
        flight.land.exaggerate(flight.factor)


def _light(gui: Gui, flight: Flight) -> None:
    """Where the sun stands."""
    settings, drawing = flight.settings, flight.settings.drawing
    if drawing.sky:
        gui.imgui.text_disabled("The sky image has a sun of its own.")
        return
    azimuth, elevation = drawing.sun
    form = "%.1f h" if drawing.sun == _sun_at(flight.hour) else "as below"
    hour = gui.slide("time of day", flight.hour, 4.0, 20.0, "The sun on a summer day in the Alps.", form)
    azimuth = azimuth % 360
    turned = gui.slide("sun from", azimuth, 0.0, 360.0, "Where the sun stands, clockwise from north.", "%.0f°")
    raised = gui.slide("sun height", elevation, -10.0, 90.0, "How high it stands over the horizon.", "%.0f°")
    if hour is not None:
        flight.hour = hour
        settings.draw_both(sun=_sun_at(hour))
    elif turned is not None or raised is not None:
        sun = azimuth if turned is None else turned, elevation if raised is None else raised
        settings.draw_both(sun=sun)


def _sun_at(hour: float) -> tuple[float, float]:
    """Azimuth and elevation in degrees."""
    azimuth, elevation = sun_position(_DAY.replace(hour=int(hour), minute=int(60 * (hour % 1))), _LATITUDE_DEG)
    return azimuth, elevation


def _water(gui: Gui, flight: Flight) -> None:
    """Standing water, and how high it is."""
    settings, water_m = flight.settings, flight.settings.drawing.water_m
    low, high = flight.renderer.heightmap.range_m
    if gui.tick("water", water_m is not None, "Standing water up to a height."):
        settings.draw_both(water_m=low + 0.1 * (high - low) if water_m is None else None)
    elif water_m is not None:
        level = gui.slide("water level", water_m, low, high, "Metres, as the map has them.", "%.0f m")
        if level is not None:
            settings.draw_both(water_m=level)


def camera(gui: Gui, flight: Flight) -> None:
    """How the eye moves."""
    controller = flight.controller
    mode = gui.choose("move", controller.mode, MODES, "Fly anywhere, orbit the middle, walk at eye height (V).")
    if mode:
        controller.change_mode(mode)
    reach = max(controller.heightmap.extent_m)
    speed = gui.slide(
        "speed",
        controller.speed_m_s,
        1e-5 * reach,
        reach,
        "Of W A S D (wheel).",
        _of_metres(controller.speed_m_s) + "/s",
        True,
    )
    if speed is not None:
        controller.speed_m_s = speed
    fov = gui.slide("field of view", controller.fov_deg, 1.0, 120.0, "Vertical (Ctrl wheel).", "%.0f°")
    if fov is not None:
        controller.fov_deg = fov
    if gui.tick("stay above ground", controller.above_ground, "Keep the eye from going under the land (G)."):
        flight.press("g")
    if gui.press_button("Home", "Back to the first view (Home)."):
        flight.press("home")
    gui.imgui.text_disabled("Bookmarks: + sets one, its number travels there")
    for number in range(1, 10):
        gui.imgui.same_line() if number > 1 else None
        known = number in controller.bookmarks
        text = (
            f"Travel to bookmark {number} (key {number})." if known else f"Set bookmark {number} here (Ctrl {number})."
        )
        if gui.press_button(str(number) if known else f"+##{number}", text):
            flight.press(str(number) if known else f"ctrl+{number}")


def keep(gui: Gui, flight: Flight) -> None:
    """What can be taken away."""
    keeping = flight.keeping
    keeping.size = (
        gui.choose("size", keeping.size, list(SIZES), "Of saved pictures, whatever the window's.") or keeping.size
    )
    text = "As PNG, its numbers as JSON beside it, in the folder where the program was started (P)."
    if gui.press_button("Save the picture", text):
        flight.press("p")
    if gui.press_button(
        "Stop recording" if flight.keeping.filming.running else "Record a film", "What is seen, without panels (R)."
    ):
        flight.press("r")
    if gui.press_button("Copy the command line", "A terrain-gl shot that draws this very picture (Y)."):
        flight.press("y")
    chosen = gui.choose("format", keeping.mesh_format, list(FORMATS), "Of saved meshes.")
    keeping.mesh_format = chosen or keeping.mesh_format
    if gui.press_button("Save the mesh", "The very triangles that are drawn, in metres (O)."):
        flight.press("o")
    text = "Bookmarks as a path for terrain-gl fly, which makes a film of it (K)."
    if gui.press_button("Save the bookmarks' path", text, len(flight.controller.bookmarks) > 1):
        flight.press("k")


FILES = {"sky image": "sky", "ground image": "material"}  # fields that files can be dropped on

SECTIONS = (
    ("Map", False, land),
    ("Detail", True, detail),
    ("Understand", True, understand),
    ("Sculpt", False, sculpt),
    ("Picture", False, picture),
    ("Camera", False, camera),
    ("Keep", False, keep),
)


def _apply(settings: Any, changes: dict[str, Any]) -> None:
    given = {key: value for key, value in changes.items() if value is not None}
    if given:
        settings.draw(**given)
