"""`terrain-gl view`: the interactive window."""

import argparse
import os
from collections.abc import Callable
from dataclasses import fields
from typing import Any

from ..basics.exceptions import UsageError
from ..files.maps import bundled, find_bundled
from ..renderer.options import FrameOptions
from . import options, overlays, report, stores, values
from .line import command_line

BACKENDS = ("auto", "egl", "glfw")
REMEMBERED = {"size", *(option.name for option in fields(FrameOptions))}  # without defaults here, for the window


def add(commands: Any) -> None:
    """Add the command."""
    first = next(iter(bundled()))
    command = options.add_command(
        commands,
        "view",
        run,
        help="fly over a map in a window",
        description=f"Fly over a map in a window; without MAP, over {first}. The key H shows all keys. A tolerance,"
        " metric, method, style or size that is not given is taken from the last window; --json writes the stats of the"
        " last frame.",
        example="view canyon --max-error 2",
    )
    options.add_map(command, optional=True)
    options.add_rendering(command)
    stores.add_options(command)
    command.add_argument("--fresh", action="store_true", help="ignore the settings of earlier windows")
    command.add_argument("--plain", action="store_true", help="hide the panel at first; the key I shows it")
    what = "type and panels F times as large; Ctrl + and - change it"
    command.add_argument("--ui-scale", type=values.positive, metavar="F", help=what)
    what = "a lecture of twelve stations, or of a JSON file"
    command.add_argument("--lecture", nargs="?", const="", metavar="FILE", help=what)
    overlays.add(command)
    lasting = [action.dest for action in command._actions if action.dest in REMEMBERED]
    command.set_defaults(**dict.fromkeys(lasting))


def run(args: argparse.Namespace) -> int:
    """Open the window."""
    if args.backend not in BACKENDS:
        raise UsageError(f"--backend {args.backend}: a window is made by one of {', '.join(BACKENDS)}")
    name = next(iter(bundled())) if args.map is None else args.map
    overlays.lay_pictures(args)
    options.check_outputs(args, name)
    known = find_bundled(name)
    from .. import viewer  # imported here, because other commands need no window

    key = known.name if known else os.path.realpath(name)
    asked = bool(args.view or options.camera_options(args))

    def opened(progress: Callable[[float], None]) -> viewer.Opened:
        few = stores.sample_meanwhile(args, name)
        if few is None:
            return whole(progress)
        scene = options.scene_over(args, few)
        return viewer.Opened(few, scene.camera, scene.sun, key, asked, rest=whole)

    def whole(progress: Callable[[float], None]) -> viewer.Opened:
        scene, offer = options.open_scene_or_sample(args, name, progress)
        laid = overlays.of(args, scene.heightmap)
        return viewer.Opened(scene.heightmap, scene.camera, scene.sun, key, asked, laid, offer)

    asked_for = options.render_options(args)
    given = {key: value for key, value in asked_for.items() if value is not None and key != "sun"}
    title = known.name if known else os.path.basename(name)
    window = {"size": args.size, "backend": args.backend, "fresh": args.fresh, "panel": False if args.plain else None}
    window |= {"ui_scale": args.ui_scale, "lecture": args.lecture}
    stats = viewer.run(opened, name=title, line_of=command_line, **window, **given)
    report.write_json(args.json, {"map": name} | stats)
    return 0
