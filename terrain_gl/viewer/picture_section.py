"""The section of the panel on the look of the picture: colours, light, water, lines, images."""

from ..basics.exceptions import TerrainError
from ..renderer.options import CHOICES
from ..shade.contours import interval_m
from .loops import latitude_deg, sun_at
from .settings import Settings
from .viewer import Viewer
from .widgets import PATH, Widgets

IMAGES = {"sky image": "sky", "ground image": "material"}  # fields that a file can be dropped on, and their options
_SURROUNDINGS = "block: the map stands on a plain or in its sea; none: it hangs in the sky."
_LOOK = "The colours of the land. auto: by the place that the file gives. Edits do not change the colours."
_GRAIN = "Bumps below the posts' spacing near the eye, in the light alone; no geometry."
_AZIMUTH = "Where the sun is, clockwise from true north."


class PictureSection:
    """The section, with the time of day, which only the panel knows."""

    def __init__(self) -> None:
        self._hour = 12.0

    def show(self, ui: Widgets, viewer: Viewer) -> None:
        settings = viewer.settings
        style = ui.choose("style", settings.options.style, CHOICES["style"], "What the colours show (Tab, J).")
        if style != settings.options.style:
            settings.change(style=style)
        choices = {"look": ("look", _LOOK)}
        if voids := viewer.scene.heightmap.voids:
            hint = f"{voids:,} posts have no data. fill: a smooth surface; hole: they are left out."
            choices["voids"] = "voids", hint
        choices |= {"surroundings": ("surroundings", _SURROUNDINGS), "grain": ("grain", _GRAIN)}
        for label, (option, hint) in choices.items():
            before = getattr(settings.options, option)
            if (chosen := ui.choose(label, before, CHOICES[option], hint)) != before:
                settings.change_all(**{option: chosen})
        _contours(ui, viewer)
        self._light(ui, settings, latitude_deg(viewer.scene.heightmap))
        _water(ui, viewer)
        hint = "Light from an equirectangular .hdr or .exr image; empty: a clear sky; none: no sky. Or drop a file."
        if (path := ui.enter("sky image", settings.options.sky or "", PATH, hint)) is not None:
            viewer.images.read("sky", path)
        hint = "Colours of the ground from an image of the map, north up; empty: colours from height and slope."
        if (path := ui.enter("ground image", settings.options.material or "", PATH, hint)) is not None:
            viewer.images.read("material", path)
        before = settings.options.haze
        if (haze := ui.slide("haze", before, (0.0, 4.0), "How thick the haze is; 0: clear air.", "× %.2f")) != before:
            settings.change_all(haze=haze)
        before = viewer.scene.exaggeration
        factor = ui.slide("exaggeration", before, (0.25, 8.0), "Relief drawn so many times as high.", "× %.2f", True)
        if factor != before:
            viewer.exaggerate(factor)

    def _light(self, ui: Widgets, settings: Settings, latitude_deg: float) -> None:
        options = settings.options
        if options.shading.sky:
            ui.imgui.text_disabled("The sky image has its own sun.")
            return
        azimuth, elevation = options.sun[0] % 360, options.sun[1]
        form = "%.1f h" if options.sun == sun_at(self._hour, latitude_deg) else "set by hand"
        hint = "The sun on a day of August, at the latitude of the map; of the Alps if the map gives none."
        hour = ui.slide("time of day", self._hour, (4.0, 20.0), hint, form)
        turned = ui.slide("sun azimuth", azimuth, (0.0, 360.0), _AZIMUTH, "%.0f°")
        raised = ui.slide("sun elevation", elevation, (-10.0, 90.0), "How high the sun is above the horizon.", "%.0f°")
        if hour != self._hour:
            self._hour = hour
            settings.change_all(sun=sun_at(hour, latitude_deg))
        elif (turned, raised) != (azimuth, elevation):
            settings.change_all(sun=(turned, raised))


def _contours(ui: Widgets, viewer: Viewer) -> None:
    contour_m = viewer.settings.options.contour_m
    hint = "Lines of equal height; each fifth is heavy (Shift C)."
    if ui.tick("contour lines", contour_m is not None, hint, "shift+c") or contour_m is None:
        return
    suits_m = interval_m(*viewer.scene.heightmap.range_m)
    hint = "Metres between contour lines; auto: an interval that suits the relief of the map."
    typed = ui.enter("interval", f"{contour_m:g}" if contour_m else f"auto: {suits_m:g} m", "auto", hint)
    if typed is None:
        return
    try:  # no text, or a word, means "auto"
        viewer.settings.change_all(contour_m=float(typed) if typed[:1].isdigit() else 0.0)
    except (ValueError, TerrainError):
        viewer.window.say(f"contour lines: expected metres between them, or auto, got {typed!r}")


def _water(ui: Widgets, viewer: Viewer) -> None:
    settings = viewer.settings
    water_m = settings.options.water_m
    low, high = viewer.scene.heightmap.range_m
    if ui.tick("water", water_m is not None, "Standing water up to a level."):
        settings.change_all(water_m=low + 0.1 * (high - low) if water_m is None else None)
    elif water_m is not None:
        level_m = ui.slide("water level", water_m, (low, high), "Metres, as in the heights of the map.", "%.0f m")
        if level_m != water_m:
            settings.change_all(water_m=level_m)
