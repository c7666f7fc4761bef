"""The command line that draws a view again, pixel for pixel."""

import argparse
import inspect
import os
import shlex
from typing import Any

from ..basics.exceptions import UsageError
from ..camera import Camera
from ..comparison.clipmap import Rings
from ..comparison.tessellated import Edges
from ..files.maps import SCALES, find_bundled
from ..files.views import standard_sun, standard_view
from ..heightmap import Heightmap
from ..pages.edited_map import EditedMap
from ..renderer.draped import COLOURS
from ..renderer.options import FrameOptions
from ..renderer.overlay import Overlay, paint_of
from . import options, overlays, stores

_CAMERA = ("eye", "target", "fov_deg", "up")
_FILES = ("sky", "material", "drape", "edits", "overlay")  # options that name files


def command_line(
    heightmap: Heightmap,
    camera: Camera,
    size: tuple[int, int],
    chosen: FrameOptions,
    output: str = "picture.png",
    laid: tuple[Overlay, ...] = (),
) -> str:
    """The `terrain-gl shot` command that draws a view again, without options that have their default values.

    The command is for a POSIX shell. It writes a picture of `size` (width, height), with the overlays `laid`, to the
    file `output`.

    Raises
    ------
    UsageError
        The map or an overlay was not opened from a file, or the map was edited since.
    """
    if heightmap.opened is None and not heightmap.is_store:
        raise UsageError(f"{heightmap.name} differs from its file: save it, and open that file")
    seen = heightmap.coarse()
    edited = heightmap if isinstance(heightmap, EditedMap) and heightmap.is_edited else None
    if edited and not edited.saved_as:
        raise UsageError(f"{heightmap.name} has edits that are in no file: save them first")
    told = dict(heightmap.opened or {"path": heightmap.name})
    known = find_bundled(path := told.pop("path"))
    if known and all(told[name] in (getattr(known, name), (getattr(known, name),) * 2) for name in SCALES):
        path = known.name
        start = known.camera
        sun = known.sun
        told = {name: value for name, value in told.items() if name not in SCALES}
    else:
        path = os.path.abspath(path)
        start = standard_view(seen)
        sun = standard_sun(seen)
        usual = inspect.signature(Heightmap.open).parameters
        told = {name: value for name, value in told.items() if known or value != usual[name].default}
        if known:  # the command must replace the bundled map's own scales
            told["spacing_m"] = heightmap.spacing_m
            told["z_scale"], told["z_offset_m"] = heightmap.scales
    if edited:
        told["edits"] = edited.saved_as
    if not all(overlay.path for overlay in laid):
        raise UsageError("an overlay is in no file: save it as GeoJSON, and open that file")
    if laid:
        told |= {"overlay": [overlay.path for overlay in laid], "labels": laid[0].label}
        told["overlay_colour"] = _colours(laid)
    told |= {name: value for name, value in vars(camera).items() if name in _CAMERA and value != getattr(start, name)}
    told |= {name: value for name, value in vars(chosen).items() if value != getattr(FrameOptions(sun=sun), name)}
    if chosen.contour_m and chosen.units != "m":  # a number alone would be in `units`
        told["contour_m"] = f"{chosen.contour_m!r}m"
    return shlex.join(["terrain-gl", "shot", path, "-o", output, *_words(told | {"size": size})])


def _colours(laid: tuple[Overlay, ...]) -> list[str]:
    """The colours of overlays, without the last ones that are the usual colours of their numbers."""
    usual = [paint_of(COLOURS[i % len(COLOURS)]) for i in range(len(laid))]
    colours = [overlay.paint or own for overlay, own in zip(laid, usual, strict=True)]
    while colours and colours[-1] == usual[len(colours) - 1]:
        colours.pop()
    return colours


def _words(told: dict[str, Any]) -> list[str]:
    """Options and their values, in the order of the help, without those that have their default value."""
    command = argparse.ArgumentParser()
    options.add_map_options(command)
    options.add_rendering(command)
    stores.add_options(command)
    overlays.add(command)
    if parameters := told.pop("parameters", None):
        told |= _parameter(parameters)
    values = {name: value for name, value in told.items() if value is not None and name != "cull"}
    words = []
    for option in command._actions:
        name = option.option_strings[-1].removeprefix("--") if option.dest == "parameters" else option.dest
        value = values.pop(name, option.default)
        for each in value if isinstance(value, list) else [value]:
            if each != option.default:
                words += [option.option_strings[-1], *_text(option.dest, each)]
    if values:
        raise UsageError(f"shot has no option for {', '.join(values)}")
    return words


def _parameter(parameters: Rings | Edges) -> dict[str, Any]:
    """A baseline's one parameter that has an option."""
    told = {"ring": parameters.ring} if isinstance(parameters, Rings) else {"edge": parameters.edge_px}
    if parameters != type(parameters)(*told.values()):
        raise UsageError(f"shot has no options for all of {parameters}")
    return told


def _text(name: str, value: Any) -> list[str]:
    """A value as text for the option, with enough digits to give exactly this number again; a switch has no text."""
    if isinstance(value, bool):
        return []
    if isinstance(value, tuple):
        return [("x" if name in ("size", "raw") else ",").join(text for each in value for text in _text("", each))]
    if name in _FILES and os.path.exists(value):
        return [os.path.abspath(value)]
    return [repr(float(value)).removesuffix(".0") if isinstance(value, float) else str(value)]
