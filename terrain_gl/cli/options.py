"""Options that the commands share, and what they stand for: a map, a camera, a level of detail, a picture."""

from __future__ import annotations

import argparse
import math
import os
import re
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from datetime import datetime
from typing import Any

from .. import maps
from ..camera import Camera
from ..drawing import METHODS, Drawing
from ..exceptions import TerrainError, UsageError
from ..heightmap import ENCODINGS, Heightmap
from ..light.sun import sun_position
from ..lod import METRICS
from ..maps import BundledMap, bundled
from ..methods.clipmap import Rings
from ..methods.tessellated import Edges
from ..renderer import Renderer
from ..shade import STYLES, SUN
from ..views import VIEWS, standard_view

FARTHEST_M = 1e9  # largest number of metres that is taken for meant


@dataclass(frozen=True)
class Scene:
    """What the options speak of: a map, where it is seen from, and the sun."""

    heightmap: Heightmap
    camera: Camera
    sun: tuple[float, float]


def add_command(commands: Any, name: str, run: Callable[[argparse.Namespace], int], **texts: str) -> Any:
    """Add a subcommand; `texts` are its help, description and example."""
    example = f"example: terrain-gl {texts['example']}"
    command = commands.add_parser(name, help=texts["help"], description=texts["description"], epilog=example)
    command.set_defaults(run=run)
    return command


def add_map(command: Any, optional: bool = False) -> None:
    """MAP and how its values are read."""
    names = ", ".join(bundled())
    command.add_argument("map", metavar="MAP", nargs="?" if optional else None, help=f"heightmap file, or {names}")
    add_map_options(command)


def add_map_options(command: Any) -> None:
    """How the values of a map are read."""
    group = command.add_argument_group("map")
    group.add_argument("--spacing", type=spacing, metavar="M", help="metres between posts, or EAST,NORTH")
    group.add_argument("--z-scale", type=number, metavar="F", help="metres per unit of value")
    group.add_argument("--z-offset", type=number, metavar="M", help="height of value 0 in metres")
    group.add_argument("--nodata", type=nodata, metavar="V", help="value that marks a void")
    group.add_argument("--encoding", choices=tuple(ENCODINGS), default="plain", help="how pixels hold heights")


def add_view(command: Any, moving: bool = False) -> None:
    """Where the picture is seen from, unless the camera is `moving`; how fine it is drawn, and how it looks."""
    add_camera(command, moving)
    add_detail(command)
    add_look(command)


def add_camera(command: Any, moving: bool = False) -> None:
    """Where the picture is seen from, and its size."""
    group = command.add_argument_group("camera")
    if moving:
        command.set_defaults(view=None, eye=None, target=None, up=None)
    else:
        group.add_argument("--view", choices=tuple(VIEWS), help="a standard view, from which --eye and --target depart")
        group.add_argument("--eye", type=point, metavar="X,Y,Z", help="where the camera stands: metres east, north, up")
        group.add_argument("--target", type=point, metavar="X,Y,Z", help="the point in the middle of the picture")
        group.add_argument("--up", type=point, metavar="X,Y,Z", help="what is up in the picture (default: 0,0,1)")
    group.add_argument("--fov", type=number, metavar="DEG", help="vertical field of view")
    group.add_argument("--size", type=size, metavar="WxH", default=(1280, 720), help="pixels (default: 1280x720)")


def add_detail(command: Any) -> None:
    """How fine the picture is drawn, and by which method."""
    group = command.add_argument_group("detail")
    what = "sat; one of its rivals; full: every post; truth: bilinear between them"
    group.add_argument("--method", choices=METHODS, default="sat", help=what)
    asked = group.add_mutually_exclusive_group()
    asked.add_argument(
        "--max-error", type=positive, metavar="PX", dest="max_error_px", help="screen error (default: 1)"
    )
    asked.add_argument(
        "--triangles", type=count, metavar="N", help="at most N, where they take away most error; of rivals about N"
    )
    asked.add_argument(
        "--ring", type=rings, metavar="N", dest="parameters", help="clipmap: vertices a ring's side (default: 255)"
    )
    asked.add_argument(
        "--edge", type=edges, metavar="PX", dest="parameters", help="tessellated: length of edges (default: 8)"
    )
    add_metric(group)


def add_metric(group: Any) -> None:
    """Which error is spoken of."""
    group.add_argument("--metric", choices=METRICS, default="max", help="largest error, or root mean square")


def add_look(command: Any) -> None:
    """How the picture looks."""
    group = command.add_argument_group("picture")
    group.add_argument("--style", choices=STYLES, default="shaded", help="what is drawn")
    lit = group.add_mutually_exclusive_group()
    lit.add_argument("--sun", type=sun, metavar="AZ,EL", help="degrees clockwise from north, and above the horizon")
    lit.add_argument("--time", type=time, metavar="T", help="the sun of a time like 2026-06-21T18:30: local solar time")
    group.add_argument("--latitude", type=latitude, metavar="DEG", help="where --time is; north is positive")
    group.add_argument("--longitude", type=number, metavar="DEG", help="for times with a zone, like 18:30-07:00")
    group.add_argument(
        "--sky", metavar="FILE", help="light from an equirectangular .hdr or .exr, north in the middle; its sun, too"
    )
    group.add_argument("--material", metavar="FILE", help="colour of the ground from a picture of the map, north up")
    group.add_argument("--water", type=number, metavar="M", dest="water_m", help="height of standing water")


def add_drawing(command: Any, moving: bool = False) -> None:
    """Everything that commands without a window share; a `moving` camera is the command's own matter."""
    add_view(command, moving)
    add_technical(command)


def add_technical(command: Any) -> None:
    """The near plane, the driver, the numbers."""
    command.add_argument("--near", type=positive, metavar="M", dest="near_m", help="near plane (default: 0.1 spacings)")
    command.add_argument(
        "--backend",
        metavar="NAME",
        default="auto",
        help="OpenGL from egl, osmesa, glfw, or auto (default)",
    )
    command.add_argument("--seed", type=int, metavar="N", help="taken from scripts: nothing that is drawn is random")
    add_json(command)


def add_json(command: Any) -> None:
    """The numbers as JSON."""
    command.add_argument("--json", metavar="FILE", help="the numbers as JSON; - for standard output, alone")


def open_scene(
    args: argparse.Namespace, name: str | None = None, progress: Callable[[float], None] | None = None
) -> Scene:
    """Open the map, by file or bundled name, and see it as the options say.

    Without options a bundled map has its own scales, view and sun; another map is seen by `views.standard_view`.
    """
    name = name or getattr(args, "map", None)
    check_outputs(args, name)
    args.sun = args.sun or clock_sun(args)
    heightmap, known = maps.open_map(name or args.map, **map_options(args), progress=progress)
    start = known.camera if known and not args.view else standard_view(heightmap, args.view or "default")
    return Scene(heightmap, replace(start, **camera_options(args)), args.sun or (known.sun if known else SUN))


def check_outputs(args: argparse.Namespace, source: str | None) -> None:
    """Refuse outputs that cannot be written, and files that are read as one: the map, a path, a sky, a material."""
    outputs = getattr(args, "output", None), getattr(args, "json", None)
    check_writable(*outputs)
    written = {os.path.realpath(path) for path in outputs if path}
    for read in (source, *(getattr(args, name, None) for name in ("path", "sky", "material"))):
        if read and os.path.realpath(read) in written:
            raise UsageError(f"{read}: is read, too: name another file for the output")


def clock_sun(args: argparse.Namespace) -> tuple[float, float] | None:
    """The sun of --time, --latitude and --longitude, if they were given."""
    if (args.time is None) != (args.latitude is None):
        raise UsageError("--time and --latitude go together: give both, or --sun")
    if args.time is None:
        return None
    if args.time.tzinfo is not None and args.longitude is None:
        raise UsageError("--time with a zone needs --longitude; without a zone it is local solar time")
    return sun_position(args.time, args.latitude, args.longitude or 0.0)


def camera_options(args: argparse.Namespace) -> dict[str, Any]:
    """What was said of the camera, by the names of `Camera`."""
    given = {"eye": args.eye, "target": args.target, "fov_deg": args.fov, "up": args.up}
    return {key: value for key, value in given.items() if value is not None}


def open_map(args: argparse.Namespace, name: str | None = None) -> tuple[Heightmap, BundledMap | None]:
    """The map, and the bundled one that it is, unless options give it another shape."""
    return maps.open_map(name or args.map, **map_options(args))


def map_options(args: argparse.Namespace) -> dict[str, Any]:
    """What `Heightmap.open` takes, by name; None where nothing was said."""
    scales = {"spacing_m": args.spacing, "z_scale": args.z_scale, "z_offset_m": args.z_offset}
    return scales | {"nodata": args.nodata, "encoding": args.encoding}


def make_renderer(args: argparse.Namespace, scene: Scene) -> Renderer:
    """A renderer for the scene."""
    return Renderer(scene.heightmap, args.size, args.backend)


def view_of(args: argparse.Namespace, scene: Scene) -> dict[str, Any]:
    """What `Renderer.render` and `Renderer.draw` take, by name: options are stored under the names of `Drawing`."""
    return drawing_options(args) | {"camera": scene.camera, "sun": scene.sun}


def drawing_options(args: argparse.Namespace) -> dict[str, Any]:
    """What was said of the drawing, by the names of `Drawing`."""
    return {option.name: getattr(args, option.name) for option in fields(Drawing) if hasattr(args, option.name)}


def add_output(command: Any, what: str) -> None:
    """The file that the command writes."""
    command.add_argument("-o", "--output", metavar="OUT", required=True, help=what)


def check_writable(*paths: str | None) -> None:
    """Refuse outputs that cannot be written before any work is done for them.

    Raises
    ------
    TerrainError
        No such folder, no permission, or something there that is not a file.
    UsageError
        One name for two outputs.
    """
    files = [path for path in paths if path is not None and path != "-"]
    for path in files:
        folder = os.path.dirname(path) or "."
        if not os.path.isdir(folder):
            raise TerrainError(f"{path}: there is no folder {folder}: make it first")
        if os.path.exists(path) and not os.path.isfile(path):
            raise TerrainError(f"{path}: is a folder or a device: name a file")
        if not os.access(folder, os.W_OK | os.X_OK):
            raise TerrainError(f"{path}: no permission to write in {folder}: choose another folder")
    if len({os.path.realpath(path) for path in files}) < len(files):
        raise UsageError(f"{files[0]}: is named for two outputs: name two files")


# --- Types of options: text to value, or one line on what was expected ------------------------------------------------


def number(text: str) -> float:
    """A finite number."""
    return _numbers(text, "a number", 1)[0]


def nodata(text: str) -> float:
    """Any number, NaN too."""
    try:
        return float(text)
    except ValueError:
        raise _expected("a number", text) from None


def positive(text: str) -> float:
    """A number above 0."""
    value = _numbers(text, "a positive number", 1)[0]
    if value <= 0:
        raise _expected("a positive number", text)
    return value


def count(text: str) -> int:
    """A whole number above 0."""
    if not re.fullmatch(r"\d{1,9}", text) or int(text) < 1:
        raise _expected("a whole number above 0", text)
    return int(text)


def rings(text: str) -> Rings:
    """A clipmap's ring: a number of vertices."""
    try:
        return Rings(count(text))
    except UsageError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def edges(text: str) -> Edges:
    """A tessellated clipmap's edges in pixels."""
    return Edges(positive(text))


def spacing(text: str) -> tuple[float, float]:
    """Metres M, or EAST,NORTH."""
    what = "metres M or EAST,NORTH above 0"
    values = _numbers(text, what, 1, 2)
    if min(values) <= 0:
        raise _expected(what, text)
    return values[0], values[-1]


def point(text: str) -> tuple[float, float, float]:
    """X,Y,Z in metres."""
    x, y, z = _numbers(text, "metres X,Y,Z", 3)
    return x, y, z


def sun(text: str) -> tuple[float, float]:
    """AZIMUTH,ELEVATION in degrees."""
    what = "degrees AZIMUTH,ELEVATION, the elevation from -90 to 90"
    azimuth, elevation = _numbers(text, what, 2)
    if abs(elevation) > 90:
        raise _expected(what, text)
    return azimuth, elevation


def time(text: str) -> datetime:
    """A date and a time, ISO 8601."""
    try:
        return datetime.fromisoformat(re.sub("[zZ]$", "+00:00", text))
    except ValueError:
        raise _expected("a time like 2026-06-21T18:30", text) from None


def latitude(text: str) -> float:
    """Degrees north of the equator."""
    value = _numbers(text, "degrees from -90 to 90", 1)[0]
    if abs(value) > 90:
        raise _expected("degrees from -90 to 90", text)
    return value


def size(text: str) -> tuple[int, int]:
    """WxH in pixels."""
    found = re.fullmatch(r"(\d{1,9})x(\d{1,9})", text)
    width, height = map(int, found.groups()) if found else (0, 0)
    if min(width, height) < 1:
        raise _expected("pixels WxH of at least 1x1", text)
    return width, height


def _numbers(text: str, what: str, *counts: int) -> list[float]:
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        raise _expected(what, text) from None
    if len(values) not in counts or not all(map(math.isfinite, values)) or max(map(abs, values)) > FARTHEST_M:
        raise _expected(what, text)
    return values


def _expected(what: str, text: str) -> argparse.ArgumentTypeError:
    return argparse.ArgumentTypeError(f"expected {what}, got {text!r}")
