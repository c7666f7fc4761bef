"""`terrain-gl view`: the interactive window."""

import os
import re
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

from ..basics.exceptions import UsageError
from ..files.maps import bundled, files_read, find_bundled
from ..renderer.options import FrameOptions, RenderOptions
from . import options, overlays, report, stores, values
from .line import command_line
from .records import DrawOptions
from .scene import open_scene_or_sample, scene_over

BACKENDS = ("auto", "egl", "glfw")
REMEMBERED = {"size", *(option.name for option in fields(FrameOptions))}  # without defaults here, for the window


@dataclass(frozen=True)
class ViewOptions(DrawOptions):
    """What `view` was told; `given` has the options of the frame that do not come from the last window."""

    given: RenderOptions
    fresh: bool
    plain: bool
    size: tuple[int, int] | None = None
    ui_scale: float | None = None
    lecture: str | None = None


def add(commands: options.Commands) -> None:
    """Add the command."""
    first = next(iter(bundled()))
    command = options.add_command(
        commands,
        "view",
        ViewOptions,
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
    what = "a lecture in stations, or that of a JSON file"
    command.add_argument("--lecture", nargs="?", const="", metavar="FILE", help=what)
    overlays.add(command)
    remembered = [action for action in command._actions if action.dest in REMEMBERED]
    lasting = [action.dest for action in remembered]
    command.set_defaults(name=first, **dict.fromkeys(lasting))
    own = {
        action.dest: re.sub(r"default: [^)]*", "default: the last window's", action.help or "") for action in remembered
    }
    options.describe(command, **own)


def run(asked: ViewOptions) -> int:
    """Open the window."""
    backend = asked.output.backend
    if backend not in BACKENDS:
        raise UsageError(f"--backend {backend}: a window is made by one of {', '.join(BACKENDS)}")
    name = asked.map.name
    drawn = overlays.with_ground(asked)
    report.check_outputs([asked.output.json], [*files_read(name), *asked.files])
    known = find_bundled(name)
    from .. import viewer  # imported here, because other commands need no window

    key = known.name if known else os.path.realpath(name)
    is_asked = bool(asked.camera.view or asked.camera.at or asked.camera.stand or asked.camera.given)

    def opened(progress: Callable[[float], None]) -> viewer.Opened:
        coarse = stores.sample_meanwhile(drawn)
        if coarse is None:
            return whole(progress)
        scene = scene_over(drawn, coarse)
        return viewer.Opened(coarse, scene.camera, scene.frame.sun, key, is_asked, rest=whole)

    def whole(progress: Callable[[float], None]) -> viewer.Opened:
        scene, offer = open_scene_or_sample(drawn, progress)
        laid = overlays.of(drawn.laid, scene.heightmap)
        return viewer.Opened(scene.heightmap, scene.camera, scene.frame.sun, key, is_asked, laid, offer)

    names = {*asked.given, "material", "drape"} - {"sun"}
    given = {name: value for name in names if (value := getattr(drawn.frame, name)) is not None}
    title = known.name if known else os.path.basename(name)
    panel = False if asked.plain else None
    window: dict[str, Any] = {name: getattr(asked, name) for name in ("size", "fresh", "ui_scale", "lecture")}
    stats = viewer.run(opened, name=title, backend=backend, panel=panel, line_of=command_line, **window, **given)
    report.write_json(asked.output.json, {"map": name} | stats)
    return 0
