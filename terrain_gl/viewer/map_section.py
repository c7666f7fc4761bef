"""The section of the panel on the map: its name and its scale."""

import os
import re

from ..files.maps import bundled
from .viewer import Viewer
from .widgets import PATH, Widgets

_RECENT = "files shown before"
_NUMBER = r"[-−+]?\d*\.?\d+(?:e[-+]?\d+)?"


def map_section(ui: Widgets, viewer: Viewer) -> None:
    """Build the section on the map."""
    opened = viewer.scene.opened
    shown = opened.key if opened.key in bundled() else viewer.painter.frame.name
    names = list(dict.fromkeys([*bundled(), shown]))
    if (name := ui.choose("map", shown, names, "The maps that come with the program.")) != shown:
        viewer.open(name)
    lost = (str(path) for path in viewer.lost if path.suffix != ".npz")
    recent = {os.path.basename(path): path for path in (*lost, *viewer.memory.recent(opened.key))}
    if recent and (name := ui.choose("recent", _RECENT, (_RECENT, *recent), "Files that were shown before.")) in recent:
        viewer.open(recent[name])
    ui.button("Open a file", "Choose a file from a folder (Ctrl O).", "ctrl+o")
    hint = "PNG, TIFF, EXR, HDR, NPY or HGT. You can also drop a file on the window."
    if path := ui.enter("file", viewer.loader.refused, PATH, hint):
        viewer.open(path)
    if viewer.scene.raster_behind:
        hint = "The raster itself instead of its store: other methods, another size, other heights."
        if ui.button("Hold in memory", hint):
            viewer.hold_in_memory()
    east, north = opened.heightmap.spacing_m
    hint = "Metres between posts. Set it if the file does not give it, or gives a wrong one."
    spacing = ui.enter("spacing", f"{east:g}" if east == north else f"{east:g} × {north:g}", "metres, then Enter", hint)
    if spacing:
        _set_spacing(viewer, spacing)
    heightmap = viewer.scene.heightmap
    east, north = heightmap.extent_m
    hint = "Metres east and north, or east alone, between the map's outer posts. For kilometres, write km."
    now = f"{east:.6g} × {north:.6g}"
    if (typed := ui.enter("map size", now, "metres, then Enter", hint)) not in (None, now):
        _set_size(viewer, typed)
    low, high = heightmap.range_m
    hint = (
        "Metres of the lowest and of the highest post. All heights in between are scaled. The file's values are "
        f"{heightmap.values}."
    )
    now = f"{low:.6g} to {high:.6g}"
    if (typed := ui.enter("heights", now, "lowest to highest", hint)) not in (None, now):
        _set_heights(viewer, typed)


def numbers(text: str) -> list[float]:
    """The numbers in a text that the user typed; with "km" they become metres."""
    unit = 1000.0 if "km" in text else 1.0
    return [unit * float(number.replace("−", "-")) for number in re.findall(_NUMBER, text, re.IGNORECASE)]


def _set_spacing(viewer: Viewer, typed: str) -> None:
    try:
        spacing_m = float(typed)
    except ValueError:
        viewer.window.say(f"spacing: expected a number of metres, got {typed!r}")
    else:
        viewer.rescale(spacing_m=(spacing_m, spacing_m))


def _set_size(viewer: Viewer, typed: str) -> None:
    heightmap = viewer.scene.heightmap
    sides = numbers(typed)
    if not 1 <= len(sides) <= 2 or min(sides) <= 0:
        viewer.window.say(f"map size: expected metres east, or east and north, above 0, got {typed!r}")
        return
    east = sides[0] / (heightmap.cols - 1)
    viewer.rescale(spacing_m=(east, sides[1] / (heightmap.rows - 1) if len(sides) > 1 else east))


def _set_heights(viewer: Viewer, typed: str) -> None:
    ends = numbers(typed)
    if len(ends) != 2 or ends[0] >= ends[1]:
        viewer.window.say(f"heights: expected metres of the lowest and of the highest post, got {typed!r}")
    else:
        viewer.rescale(range_m=(ends[0], ends[1]))
