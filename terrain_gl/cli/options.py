"""Options that the commands share, and the objects that they describe: map, camera, level of detail, picture."""

import argparse
import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..basics import resources
from ..basics.exceptions import TerrainError, UsageError
from ..basics.steps import drain
from ..camera import Camera, Vector
from ..files import maps
from ..files.huge import is_huge, sample
from ..files.maps import BundledMap, bundled
from ..files.views import VIEWS, depth_below_ground, drawn_near, look_at, stand_at, standard_sun, standard_view
from ..heightmap import Heightmap
from ..light.lighting import check_room
from ..light.sun import sun_position
from ..readers.arrays import ORDERS
from ..readers.values import ENCODINGS
from ..readers.windows import WindowedRaster
from ..renderer import Renderer
from ..renderer.options import OPTIONS, FrameOptions
from ..shade.picture import Look
from ..store import cache, is_store
from . import overlays, report, stores, values
from .parsing import HelpAll

FILES = ("path", "sky", "material", "drape", "edits")  # options that name files to read
EXCLUSIVE = ("max_error_px", "triangles", "parameters")  # they choose the detail; at most one is given


@dataclass(frozen=True)
class CommandScene:
    """The map, the camera and the sun that the options describe."""

    heightmap: Heightmap
    camera: Camera
    sun: tuple[float, float]


def add_command(commands: Any, name: str, run: Callable[[argparse.Namespace], int], **texts: str) -> Any:
    """Add a subcommand; `texts` are its help, description and example."""
    example = f"example: terrain-gl {texts['example']}"
    command = commands.add_parser(name, help=texts["help"], description=texts["description"], epilog=example)
    command.add_argument("--help-all", action=HelpAll, help="show every option and exit")
    command.set_defaults(run=run)
    return command


def add_map(command: Any, optional: bool = False) -> None:
    """Add the argument MAP, and the options for reading its values."""
    names = ", ".join(bundled())
    command.add_argument("map", metavar="MAP", nargs="?" if optional else None, help=f"a file, or {names}")
    add_map_options(command)


def add_map_options(command: Any) -> None:
    """Add the options for reading the values of a map."""
    group = command.add_argument_group("map")
    group.add_argument("--spacing", type=values.spacing, metavar="M", help="metres between posts, or EAST,NORTH")
    group.add_argument("--z-scale", type=values.number, metavar="F", help="metres per unit of value")
    group.add_argument("--z-offset", type=values.number, metavar="M", help="height of value 0 in metres")
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


def add_camera(command: Any, moving: bool = False) -> None:
    """Add the options for the camera and the size of the picture."""
    group = command.add_argument_group("camera")
    if moving:
        command.set_defaults(view=None, eye=None, target=None, up=None, at=None, stand=None)
        command.set_defaults(coordinates="metres")
    else:
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
    group.add_argument("--fov", type=values.number, metavar="DEG", help="vertical field of view")
    group.add_argument(
        "--size", type=values.size, metavar="WxH", default=(1280, 720), help="pixels (default: 1280x720)"
    )


def add_detail(command: Any) -> None:
    """Add the options for level of detail and method."""
    group = command.add_argument_group("detail")
    asked = group.add_mutually_exclusive_group()
    for name in _under("detail"):
        add_option(asked if name in EXCLUSIVE else group, name)


def add_look(command: Any) -> None:
    """Add the options for the look of the picture."""
    group = command.add_argument_group("picture")
    for name in _under("picture"):
        if name == "sun":
            _add_sun(group)
        else:
            add_option(group, name)


def add_option(group: Any, name: str) -> None:
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


def _add_sun(group: Any) -> None:
    """Add the options for the sun, by its direction or by the clock."""
    lit = group.add_mutually_exclusive_group()
    add_option(lit, "sun")
    what = "the sun of a time like 2026-06-21T18:30: local solar time"
    lit.add_argument("--time", type=values.time, metavar="T", help=what)
    group.add_argument(
        "--latitude", type=values.latitude, metavar="DEG", help="where --time is (default: where the map lies)"
    )
    group.add_argument("--longitude", type=values.number, metavar="DEG", help="for times with a zone, like 18:30-07:00")


def add_rendering(command: Any, moving: bool = False) -> None:
    """Add all options that commands which draw share. With `moving`, the camera comes from a path."""
    add_camera(command, moving)
    add_detail(command)
    add_look(command)
    add_technical(command)


def add_technical(command: Any) -> None:
    """Add the options for the near plane, the driver and the numbers."""
    group = command.add_argument_group("technical")
    for name in _under("technical"):
        add_option(group, name)
    add_backend(group)
    what = "has no effect: nothing in the drawing is random; accepted for scripts"
    group.add_argument("--seed", type=int, metavar="N", help=what)
    add_json(group)


def add_backend(command: Any) -> None:
    """Add `--backend`."""
    what = "OpenGL from egl, osmesa, glfw, or auto (default)"
    command.add_argument("--backend", metavar="NAME", default="auto", help=what)


def add_json(command: Any) -> None:
    """Add `--json`."""
    command.add_argument("--json", metavar="FILE", help="the numbers as JSON; - for standard output, alone")


def open_scene(
    args: argparse.Namespace, name: str | None = None, progress: Callable[[float], None] | None = None
) -> CommandScene:
    """Open the map, by file or bundled name, and choose camera and sun by the options.

    A bundled map brings default scales, view and sun. For other maps, `files.views` computes a default view and sun.
    """
    name = args.map if name is None else name
    check_outputs(args, name)
    if args.time is None and args.latitude is not None:
        raise UsageError("--latitude needs --time: give both, or --sun")
    heightmap, known, seen = _opened(args, name, progress)
    args.sun = args.sun or clock_sun(args, heightmap)
    start = known.camera if known and not args.view else _first_view(args, seen)
    camera = _camera(args, heightmap, start)
    if (below_m := depth_below_ground(seen, camera)) > 0:
        report.note(f"the eye is {below_m:.3g} m under the ground: give --eye more height")
    return CommandScene(heightmap, camera, args.sun or (known.sun if known else standard_sun(seen)))


def open_scene_or_sample(
    args: argparse.Namespace, name: str, progress: Callable[[float], None] | None = None
) -> tuple[CommandScene, str]:
    """Open the scene, or a coarse sample of a raster that is too large for memory and of which no store is made.

    With a sample comes a text that says how to draw the whole raster; else the text is empty.
    """
    reading = stores.reading_of(args)
    if not is_huge(name, reading) or (not args.no_cache and cache.is_possible()):
        return open_scene(args, name, progress), ""
    stores.check_no_edits(args, name)
    few, offer = sample(name, reading, args.spacing)
    report.note(offer)
    tell_notes(few)
    return scene_over(args, few), offer


def scene_over(args: argparse.Namespace, few: Heightmap) -> CommandScene:
    """The scene of a coarse sample of the map."""
    camera = _camera(args, few, _first_view(args, few))
    return CommandScene(few, camera, args.sun or clock_sun(args, few) or standard_sun(few))


def _opened(
    args: argparse.Namespace, name: str, progress: Callable[[float], None] | None
) -> tuple[Heightmap, BundledMap | None, Heightmap]:
    """The map; its `BundledMap`, if it is one; and the map from which a view is chosen, which may be coarser."""
    if is_store(name):
        given = stores.opened(args, name, map_options(args))
        return given, None, given.coarse()
    stores.check_no_edits(args, name)
    if stored := stores.of_raster(args, name, map_options(args), progress):
        tell_notes(stored)
        return stored, None, stored.coarse()
    heightmap, known = maps.open_map(name, **map_options(args), progress=progress)
    tell_notes(heightmap)
    return heightmap, known, heightmap


def check_outputs(args: argparse.Namespace, source: str | None) -> None:
    """Refuse outputs that cannot be written, or that are also inputs: the map, or the file of an option."""
    outputs = getattr(args, "output", None), getattr(args, "json", None)
    check_writable(*outputs)
    others = [path for name in FILES if (path := getattr(args, name, None))]
    others += getattr(args, "overlay", [])
    refuse_inputs(outputs, [*(maps.files_read(source) if source else ()), *others])


def refuse_inputs(outputs: Iterable[str | None], inputs: Iterable[str]) -> None:
    """Refuse outputs that are also inputs."""
    written = {os.path.realpath(path) for path in outputs if path}
    for read in inputs:
        if os.path.realpath(read) in written:
            raise UsageError(f"{read}: is also an input: name another file for the output")


def clock_sun(args: argparse.Namespace, heightmap: Heightmap) -> tuple[float, float] | None:
    """The sun of --time at the place of --latitude and --longitude, or where the map lies."""
    if args.time is None:
        return None
    latitude, longitude = args.latitude, args.longitude
    if latitude is None:
        if heightmap.place is None or heightmap.place.crs is None:
            raise UsageError("--time needs --latitude, because the place of the map is not known; or give --sun")
        middle = heightmap.place.middle
        latitude, longitude = middle[1], middle[0] if longitude is None else longitude
    if args.time.tzinfo is not None and longitude is None:
        raise UsageError("--time with a zone needs --longitude; without a zone it is local solar time")
    return sun_position(args.time, latitude, longitude or 0.0)


def camera_options(args: argparse.Namespace) -> dict[str, Any]:
    """The given camera options, by the names of `Camera`; and the given options for places in degrees."""
    given = {"eye": args.eye, "target": args.target, "fov_deg": args.fov, "up": args.up}
    return {key: value for key, value in (given | {"at": args.at, "stand": args.stand}).items() if value is not None}


def _first_view(args: argparse.Namespace, heightmap: Heightmap) -> Camera:
    """A standard view, chosen for the exaggerated relief."""
    factor = getattr(args, "exaggeration", None) or 1.0
    return standard_view(heightmap.exaggerated(factor), args.view or "default").over_exaggerated(1 / factor)


def _camera(args: argparse.Namespace, heightmap: Heightmap, start: Camera) -> Camera:
    """The camera of a first view, changed by the options."""
    given = camera_options(args)
    if args.coordinates == "map":
        given |= {name: _in_metres(heightmap, given[name]) for name in ("eye", "target") if name in given}
    at = given.pop("at", None)
    stand = given.pop("stand", None)
    camera = replace(start, **given)
    if at:
        camera = look_at(heightmap, replace(start, **given), *at)
    if stand:
        return stand_at(heightmap, camera, *stand)
    if at and not args.eye:
        moved = np.subtract(camera.target, start.target)
        return drawn_near(heightmap, replace(camera, eye=tuple(np.add(start.eye, moved).tolist())))
    return camera


def _in_metres(heightmap: Heightmap, point: Vector) -> Vector:
    """World metres of a point that is given in the map's own coordinates, with metres of height."""
    place = heightmap.place
    if place is None:
        raise UsageError("--coordinates map: the map does not say where it lies")
    x, y = place.from_map(float(place.nearest_turn(np.array([point[0]]))[0]), point[1])
    return x, y, point[2]


def tell_notes(heightmap: Heightmap | WindowedRaster) -> None:
    """Print notes on how a file was interpreted to standard error."""
    for note in heightmap.notes:
        report.note(f"{report.shown(heightmap.name)}: {note}")


def map_options(args: argparse.Namespace) -> dict[str, Any]:
    """Arguments of `Heightmap.open`, by name; None for options that were not given."""
    return {
        "spacing_m": args.spacing,
        "z_scale": args.z_scale,
        "z_offset_m": args.z_offset,
        "nodata": args.nodata,
        "encoding": args.encoding,
        "trusted": args.trusted,
        "band": args.band,
        "raw": args.raw,
        "byte_order": args.byte_order,
    }


def make_renderer(
    args: argparse.Namespace, scene: CommandScene, size: tuple[int, int] | None = None, lit: bool = False
) -> Renderer:
    """A renderer for the scene, with its overlays. With `lit`, check that there is room for the tables of light."""
    laid = overlays.of(args, scene.heightmap) if hasattr(args, "overlay") else ()
    renderer = Renderer(scene.heightmap, size or args.size, args.backend, build=False)
    try:
        if lit and Look(args.style).is_lit and not scene.heightmap.is_store:
            check_room(renderer.ctx, scene.heightmap)
        drain(renderer.build_steps)
        stores.rebuild(renderer)
    except BaseException:
        renderer.release()
        raise
    renderer.overlays = laid
    return renderer


def view_of(args: argparse.Namespace, scene: CommandScene) -> dict[str, Any]:
    """Keyword arguments of `Renderer.render`: the fields of `FrameOptions` that the command line gave."""
    return render_options(args) | {"camera": scene.camera, "sun": scene.sun}


def render_options(args: argparse.Namespace) -> dict[str, Any]:
    """The options of a frame that the command line gave, by the names of `FrameOptions`."""
    return {option.name: getattr(args, option.name) for option in fields(FrameOptions) if hasattr(args, option.name)}


def add_workers(group: Any) -> None:
    """Add the options for workers: processes of this machine, or a cluster."""
    what = "processes of this machine (default: 1)"
    group.add_argument("--workers", type=values.count, metavar="N", default=1, help=what)
    group.add_argument("--scheduler", metavar="ADDRESS", help="a Dask scheduler, like tcp://host:8786; extra [dask]")


def add_output(command: Any, what: str) -> None:
    """Add the option for the file that the command writes."""
    command.add_argument("-o", "--output", metavar="OUT", required=True, help=what)


def check_writable(*paths: str | None) -> None:
    """Refuse outputs that cannot be written, and two outputs with one name, before any work is done."""
    files = [path for path in paths if path is not None and path != "-"]
    for path in files:
        folder = os.path.dirname(path) or "."
        if not os.path.isdir(folder):
            raise TerrainError(f"{path}: there is no folder {folder}: make it first")
        if os.path.exists(path) and not os.path.isfile(path):
            raise TerrainError(f"{path}: is a folder or a device: name a file")
        if not os.access(folder, os.W_OK | os.X_OK):
            raise TerrainError(f"{path}: no permission to write in {folder}: choose another folder")
        if resources.holds(Path(path)):
            raise UsageError(f"{path}: comes with terrain-gl: name another file for the output")
    if len({os.path.realpath(path) for path in files}) < len(files):
        raise UsageError(f"{files[0]}: is the name of two outputs: name two files")
