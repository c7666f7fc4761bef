"""The section of the panel on the look of the picture: colours, light, water, lines, images."""

from dataclasses import dataclass
from datetime import datetime

from ..basics.exceptions import TerrainError
from ..heightmap import Heightmap
from ..light.sun import sun_position
from ..renderer.options import CHOICES
from ..shade.contours import interval_m
from .scene import Scene
from .settings import Settings
from .viewer import Viewer
from .widgets import PATH, Widgets

IMAGES = {"sky image": "sky", "ground image": "material"}  # fields that a file can be dropped on, and their options
_LATITUDE_DEG = 46.0  # latitude for the time of day, if the map does not give its place
_DAY = datetime(2025, 8, 1)
_ROWS = {  # choices that need no further code: label and option, with a line of help
    ("surroundings", "edge"): "block: the map stands on a plain or in its sea; none: it hangs in the sky.",
    ("grain", "grain"): "Bumps below the posts' spacing near the eye, in the light alone; no geometry.",
}


@dataclass
class PictureDraft:
    """Values that only the panel knows: the time of day."""

    hour: float = 12.0


def picture_section(ui: Widgets, viewer: Viewer, draft: PictureDraft) -> None:
    """Build the section on the look of the picture."""
    settings = viewer.settings
    style = ui.choose("style", settings.options.style, CHOICES["style"], "What the colours show (Tab, J).")
    if style:
        settings.change(style=style)
    hint = "The colours of the land. auto: by what the file says of its place; they do not change with edits."
    if look := ui.choose("look", settings.options.look, CHOICES["look"], hint):
        settings.change_all(look=look)
    if viewer.scene.has_map and viewer.scene.heightmap.voids:
        hint = f"{viewer.scene.heightmap.voids:,} posts have no data. fill: a smooth surface; hole: they are left out."
        if voids := ui.choose("voids", settings.options.voids, CHOICES["voids"], hint):
            settings.change_all(voids=voids)
    for option, hint in _ROWS.items():
        if chosen := ui.choose(option[0], getattr(settings.options, option[1]), CHOICES[option[1]], hint):
            settings.change_all(**{option[1]: chosen})
    _contours(ui, viewer)
    _light(ui, settings, draft, latitude_of(viewer.scene.heightmap))
    _water(ui, viewer.scene)
    hint = "Light from an equirectangular .hdr or .exr image; empty: a clear sky. Type a path, or drop a file here."
    if (path := ui.enter("sky image", settings.options.sky or "", PATH, hint)) is not None:
        viewer.images.read("sky", path)
    hint = "Colours of the ground from an image of the map, north up; empty: colours from height and slope."
    if (path := ui.enter("ground image", settings.options.material or "", PATH, hint)) is not None:
        viewer.images.read("material", path)
    factor = ui.slide("exaggeration", viewer.scene.exaggeration, 0.25, 8.0, "How many times higher.", "× %.2f", True)
    if factor is not None:
        viewer.exaggerate(factor)


def _contours(ui: Widgets, viewer: Viewer) -> None:
    settings = viewer.settings
    contour_m = viewer.settings.options.contour_m
    if ui.tick("contour lines", contour_m is not None, "Lines of equal height; each fifth is heavy (Shift C)."):
        settings.toggle_contours()
    elif contour_m is not None:
        suits_m = interval_m(*viewer.scene.heightmap.range_m)
        hint = "Metres between contour lines; auto: an interval that suits the relief of the map."
        typed = ui.enter("interval", f"{contour_m:g}" if contour_m else f"auto: {suits_m:g} m", "auto", hint)
        if typed is not None:
            _set_contours(viewer, typed)


def _set_contours(viewer: Viewer, typed: str) -> None:
    """Take the interval that the user typed. No text, or a word, means "auto"."""
    try:
        viewer.settings.change_all(contour_m=float(typed) if typed[:1].isdigit() else 0.0)
    except (ValueError, TerrainError):
        viewer.window.say(f"contour lines: expected metres between them, or auto, got {typed!r}")


def latitude_of(heightmap: Heightmap) -> float:
    """Latitude in degrees, for the time of day."""
    try:
        known = heightmap.place and heightmap.place.crs and heightmap.place.middle
    except TerrainError:  # pyproj is missing
        known = None
    return known[1] if known else _LATITUDE_DEG


def _light(ui: Widgets, settings: Settings, draft: PictureDraft, latitude_deg: float) -> None:
    options = settings.options
    if options.sky:
        ui.imgui.text_disabled("The sky image has its own sun.")
        return
    azimuth, elevation = options.sun
    form = "%.1f h" if options.sun == _sun_at(draft.hour, latitude_deg) else "as below"
    hint = "The sun on a day of August, at the latitude of the map; of the Alps if the map gives none."
    hour = ui.slide("time of day", draft.hour, 4.0, 20.0, hint, form)
    turned = ui.slide("sun azimuth", azimuth % 360, 0.0, 360.0, "Where the sun is, clockwise from north.", "%.0f°")
    raised = ui.slide("sun elevation", elevation, -10.0, 90.0, "How high the sun is above the horizon.", "%.0f°")
    if hour is not None:
        draft.hour = hour
        settings.change_all(sun=_sun_at(hour, latitude_deg))
    elif turned is not None or raised is not None:
        sun = azimuth % 360 if turned is None else turned, elevation if raised is None else raised
        settings.change_all(sun=sun)


def _sun_at(hour: float, latitude_deg: float) -> tuple[float, float]:
    """Azimuth and elevation in degrees."""
    azimuth, elevation = sun_position(_DAY.replace(hour=int(hour), minute=int(60 * (hour % 1))), latitude_deg)
    return azimuth, elevation


def _water(ui: Widgets, scene: Scene) -> None:
    settings = scene.settings
    water_m = scene.settings.options.water_m
    low, high = scene.heightmap.range_m
    if ui.tick("water", water_m is not None, "Standing water up to a level."):
        settings.change_all(water_m=low + 0.1 * (high - low) if water_m is None else None)
    elif water_m is not None:
        level = ui.slide("water level", water_m, low, high, "Metres, as in the heights of the map.", "%.0f m")
        if level is not None:
            settings.change_all(water_m=level)
