"""Options that the commands share, declared in groups: map, camera, level of detail, picture."""

import argparse
from collections.abc import Callable
from typing import Any, TypeAlias

from ..files.maps import bundled
from ..files.views import VIEWS
from ..readers.arrays import ORDERS
from ..readers.values import ENCODINGS
from ..renderer.facts import FORMATS
from ..renderer.options import OPTIONS, FrameOptions
from . import values
from .parsing import HelpAll, Parser
from .records import Record

Commands: TypeAlias = "argparse._SubParsersAction[Parser]"
Options: TypeAlias = argparse._ActionsContainer  # a command, or a group of its options
EXCLUSIVE = ("max_error_px", "triangles", "parameters")  # they choose the detail; at most one is given


def add_command(
    commands: Commands, name: str, record: type[Record], run: Callable[[Record], int], **texts: str
) -> Parser:
    """Add a subcommand that gets a `record`; `texts` are its help, description and example."""
    example = f"example: terrain-gl {texts['example']}"
    command = commands.add_parser(name, help=texts["help"], description=texts["description"], epilog=example)
    command.add_argument("--help-all", action=HelpAll, help="show every option and exit")
    command.set_defaults(run=run, record=record)
    return command


def group_of(command: Options, title: str) -> Options:
    """The group of the help with a title; a new one if there is none."""
    return next((group for group in command._action_groups if group.title == title), None) or (
        command.add_argument_group(title)
    )


def describe(command: Options, **texts: str) -> None:
    """Change the help of options, by the names of their values."""
    for action in command._actions:
        action.help = texts.get(action.dest, action.help)


def add_map(command: Options, optional: bool = False) -> None:
    """Add the argument MAP, and the options for reading its values."""
    names = ", ".join(bundled())
    command.add_argument("name", metavar="MAP", nargs="?" if optional else None, help=f"a file, or {names}")
    add_map_options(command)


def add_map_options(command: Options) -> None:
    """Add the options for reading the values of a map."""
    group = command.add_argument_group("map")
    what = "metres between posts, or EAST,NORTH"
    group.add_argument("--spacing", type=values.spacing, metavar="M", dest="spacing_m", help=what)
    group.add_argument("--z-scale", type=values.number, metavar="F", help="metres per unit of value")
    what = "height of value 0 in metres"
    group.add_argument("--z-offset", type=values.number, metavar="M", dest="z_offset_m", help=what)
    what = "value that marks a void; none: only the value in the file does"
    group.add_argument("--nodata", type=values.nodata, metavar="V", help=what)
    what = f"how pixels hold heights: {', '.join(ENCODINGS)}"
    group.add_argument("--encoding", metavar="NAME", default="plain", help=what)
    group.add_argument("--band", type=values.band, metavar="N", help="the band that holds the heights, or its name")
    what = "MAP is bare posts, row after row (.raw and .r16 of a square need no size)"
    group.add_argument("--raw", type=values.size, metavar="WxH", help=what)
    what = "of bare posts: which end of a number comes first (default: by the smoother land)"
    group.add_argument("--byte-order", choices=tuple(ORDERS), help=what)
    what = "let GDAL follow MAP to other files and to the network: only for maps that you trust"
    group.add_argument("--trust", action="store_true", dest="trusted", help=what)


def add_camera(command: Options, moving: bool = False) -> None:
    """Add the options for the camera and the size of the picture."""
    group = command.add_argument_group("camera")
    if not moving:
        group.add_argument("--view", choices=tuple(VIEWS), help="a standard view; --eye and --target change it")
        eye = group.add_mutually_exclusive_group()
        target = group.add_mutually_exclusive_group()
        eye.add_argument("--eye", type=values.point, metavar="X,Y,Z", help="the camera: metres east, north, up")
        what = "the camera, M metres above the ground (default: 2 posts)"
        eye.add_argument("--from", type=values.lonlat, metavar="LON,LAT[,M]", dest="stand", help=what)
        target.add_argument("--target", type=values.point, metavar="X,Y,Z", help="the point in mid-picture")
        what = "as --target; without an eye, seen from nearby"
        target.add_argument("--at", type=values.lonlat, metavar="LON,LAT[,M]", help=what)
        what = "of --eye and --target: metres from the south-west post, or coordinates of the map's own system"
        group.add_argument("--coordinates", choices=("metres", "map"), default="metres", help=what)
        group.add_argument("--up", type=values.point, metavar="X,Y,Z", help="up in the picture (default: 0,0,1)")
    what = "vertical field of view"
    group.add_argument("--fov", type=values.number, metavar="DEG", dest="fov_deg", help=what)
    group.add_argument(
        "--size", type=values.size, metavar="WxH", default=(1280, 720), help="pixels (default: 1280x720)"
    )


def add_detail(command: Options) -> None:
    """Add the options for level of detail and method."""
    group = command.add_argument_group("detail")
    asked = group.add_mutually_exclusive_group()
    for name in _under("detail"):
        add_option(asked if name in EXCLUSIVE else group, name)


def add_look(command: Options) -> None:
    """Add the options for the look of the picture."""
    group = group_of(command, "picture")
    for name in _under("picture"):
        if name == "sun":
            _add_sun(group)
        else:
            add_option(group, name)


def add_option(group: Options, name: str) -> None:
    """Add an option as declared in `FrameOptions`. The sun has no default here: a bundled map brings its own."""
    option = OPTIONS[name]
    default = None if name == "sun" else getattr(FrameOptions, name)
    for flag in option.flags:
        how: dict[str, Any] = {"metavar": flag.metavar, "default": default}
        if option.choices:
            how = {"choices": option.choices, "default": default}
            if name == "method":
                how["type"] = values.method
        elif flag.kind != "file":
            how["type"] = getattr(values, flag.kind)
        group.add_argument(flag.name, dest=name, help=flag.help, **how)


def _under(heading: str) -> list[str]:
    return [name for name, option in OPTIONS.items() if option.heading == heading]


def _add_sun(group: Options) -> None:
    """Add the options for the sun, by its direction or by the clock."""
    lit = group.add_mutually_exclusive_group()
    add_option(lit, "sun")
    what = "the sun of a time like 2026-06-21T18:30: local solar time"
    lit.add_argument("--time", type=values.time, metavar="T", help=what)
    group.add_argument(
        "--latitude", type=values.latitude, metavar="DEG", help="where --time is (default: where the map lies)"
    )
    group.add_argument("--longitude", type=values.number, metavar="DEG", help="for times with a zone, like 18:30-07:00")


def add_rendering(command: Options, moving: bool = False) -> None:
    """Add all options that commands which draw share. With `moving`, the camera comes from a path."""
    add_camera(command, moving)
    add_detail(command)
    add_look(command)
    add_technical(command)


def add_technical(command: Options) -> None:
    """Add the options for the near plane, the driver and the numbers."""
    group = command.add_argument_group("technical")
    for name in _under("technical"):
        add_option(group, name)
    add_backend(group)
    what = "has no effect: nothing in the drawing is random; accepted for scripts"
    group.add_argument("--seed", type=int, metavar="N", help=what)
    add_json(group)


def add_backend(command: Options) -> None:
    """Add `--backend`."""
    what = "OpenGL from egl, osmesa, glfw, or auto (default)"
    command.add_argument("--backend", metavar="NAME", default="auto", help=what)


def add_json(command: Options) -> None:
    """Add `--json`."""
    command.add_argument("--json", metavar="FILE", help="the numbers as JSON; - for standard output, alone")


def add_facts(command: Options) -> None:
    """Add `--facts`."""
    what = "write what each pixel shows, too (depth, place, normal, kind): a file beside the picture"
    group_of(command, "technical").add_argument("--facts", choices=[ending[1:] for ending in FORMATS], help=what)


def add_workers(group: Options) -> None:
    """Add the options for workers: processes of this machine, or a cluster."""
    what = "processes of this machine (default: 1)"
    group.add_argument("--workers", type=values.count, metavar="N", default=1, help=what)
    group.add_argument("--scheduler", metavar="ADDRESS", help="a Dask scheduler, like tcp://host:8786; extra [dask]")


def add_output(command: Options, what: str) -> None:
    """Add the option for the file that the command writes."""
    command.add_argument("-o", "--output", metavar="OUT", dest="path", required=True, help=what)
