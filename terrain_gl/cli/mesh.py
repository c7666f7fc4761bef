"""`terrain-gl mesh`: a file with exactly the triangles that the GPU draws."""

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..basics.exceptions import TerrainError, UsageError
from ..files.export import FORMATS, files_beside, land_mesh, mesh_format, with_whole_rim, write_mesh
from ..files.mesh_formats import PRINT_MM, Mesh
from ..heightmap import Heightmap
from ..image import file_bytes
from ..renderer import Renderer
from ..renderer.plan import LONGEST_PX, plan
from ..shade.picture import UNLIT
from . import options, report, stores, values

RELIEF_SHARE = 5e-3  # default error of a mesh, as a part of the map's relief
_PAYS_TIMES = 4  # a raster of fewer posts than 4 · `cache.PAYS_POSTS` is held in memory: no store is built for it
_VIEW_OPTIONS = ("max_error_px", "triangles", "parameters", "cull", "view", "eye", "target", "at", "stand")


def add(commands: Any) -> None:
    """Add the command."""
    command = options.add_command(
        commands,
        "mesh",
        run,
        help="the map as triangles: a .ply, .glb, .obj or .stl file, or an .html page",
        description="Write the triangles that the GPU draws, in metres: of the whole map, or of a view (with\n"
        "a camera or an error in pixels). .stl is a solid, .html a page.",
        example="mesh dem.tif -o dem.glb --max-error-m 5 --texture",
    )
    options.add_map(command)
    options.add_output(command, f"mesh, {', '.join(FORMATS)}")
    what = f"largest error of height (default: {100 * RELIEF_SHARE:g} %% of the relief)"
    command.add_argument("--max-error-m", type=values.positive, metavar="M", help=what)
    what = f"the look from above, N pixels long (default: {LONGEST_PX})"
    command.add_argument("--texture", type=values.count, metavar="N", nargs="?", const=LONGEST_PX, help=what)
    what = "share vertices (default), or three for each triangle"
    command.add_argument("--weld", action=argparse.BooleanOptionalAction, default=True, help=what)
    what = f".stl: longer side in millimetres (default: {PRINT_MM:g})"
    command.add_argument("--print-mm", type=values.positive, metavar="MM", default=PRINT_MM, help=what)
    what = ".stl: height of the base; tiles of one base meet"
    command.add_argument("--base-m", type=values.number, metavar="M", help=what)
    command.add_argument("--cull", action="store_true", help="of a view: leave out patches outside the picture")
    stores.add_options(command, pays_times=_PAYS_TIMES)
    options.add_rendering(command)
    command.set_defaults(method=None)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    mesh_format(args.output)
    is_page = Path(args.output).suffix.lower() == ".html"
    if is_page:
        args.texture = args.texture or LONGEST_PX
    if args.max_error_m and (args.triangles or args.max_error_px or args.method):
        of_view = "--triangles, --max-error and --method"
        raise UsageError(f"--max-error-m is for the whole map, not for a view: leave out {of_view}")
    if args.base_m is not None and (Path(args.output).suffix.lower() != ".stl" or _has_view(args)):
        raise UsageError("--base-m is for the solid of a whole map, an .stl without a camera")
    if args.texture:
        options.check_writable(*map(str, files_beside(args.output)))
    scene = options.open_scene(args)
    _tell_water(args, scene.heightmap)
    drawn = _drawn(args, scene, is_page)
    if drawn is None:
        report.note("the mesh needs more tiles than --gpu-memory holds: the raster is held in memory instead")
        args.no_cache = True
        scene = options.open_scene(args)
        drawn = _drawn(args, scene, is_page)
    assert drawn
    mesh, stats = drawn
    if args.base_m is not None:
        mesh = replace(with_whole_rim(mesh), bottom_m=args.base_m * args.exaggeration)
        stats["certified_max_error_m"] *= 2  # see `with_whole_rim`
    within_m = stats.get("certified_max_error_m")
    mesh = replace(mesh, within_m=within_m, print_mm=args.print_mm)
    about = {"map": scene.heightmap.name} | stats | {"vertices": len(mesh.posts)}
    with report.json_output(args.json, about), report.progress_bar("writing") as progress:
        write_mesh(args.output, mesh, progress)
    within = "" if within_m is None else f", within {within_m:.3g} m"
    counts = f"{len(mesh.faces):,} triangles, {len(mesh.posts):,} vertices"
    report.say(args.json, f"{report.shown(args.output)}: {counts}{within}")
    return stores.status_of(about)


def _drawn(args: argparse.Namespace, scene: options.CommandScene, is_page: bool) -> tuple[Mesh, dict[str, Any]] | None:
    """The mesh and its numbers; None if a raster's store lacks room for its tiles, and the raster fits into memory."""
    sea = _with_sea(args, scene.heightmap)
    texture = None
    if args.texture and sea is not scene.heightmap:  # water is drawn over its bed
        with options.make_renderer(args, scene) as renderer:
            texture = _texture(renderer, args, scene, is_page)
    with options.make_renderer(args, replace(scene, heightmap=sea)) as renderer, stores.loading(renderer):
        if args.method:
            renderer.check_method(args.method)
        if args.texture and texture is None:
            texture = _texture(renderer, args, scene, is_page)
        triangles, heights, stats = _of_view(renderer, args, scene) if _has_view(args) else _of_map(renderer, args)
        if not stats.get("complete", True) and stores.may_be_held(scene.heightmap):
            return None
        if not len(triangles):
            raise TerrainError(f"{scene.heightmap.name}: no triangles in this view: turn the camera or drop --cull")
        heights = heights if args.exaggeration == 1 else heights * np.float32(args.exaggeration)
        mesh = land_mesh(renderer.heightmap, triangles, heights, args.voids, args.weld)
    return replace(mesh, texture=texture), stats


def _with_sea(args: argparse.Namespace, heightmap: Heightmap) -> Heightmap:
    """The map whose land below --water is the level sea."""
    if args.water_m is None:
        return heightmap
    if heightmap.is_store:
        raise UsageError(
            "--water: a mesh of a store cannot have a sea: give the raster with --no-cache, or drop --water"
        )
    return heightmap.copy(np.maximum(heightmap.heights, np.float32(args.water_m)))


def _tell_water(args: argparse.Namespace, heightmap: Heightmap) -> None:
    low_m = heightmap.range_m[0]
    if args.water_m is not None and args.water_m <= low_m:
        report.note(f"--water {args.water_m:g}: without effect, because the lowest height is {low_m:g} m")


def _has_view(args: argparse.Namespace) -> bool:
    """Whether the options request the mesh of a view."""
    is_asked = args.method is not None or any(getattr(args, name) for name in _VIEW_OPTIONS)
    return not args.max_error_m and is_asked


def _of_view(
    renderer: Renderer, args: argparse.Namespace, scene: options.CommandScene
) -> tuple[np.ndarray, np.ndarray, dict[str, Any]]:
    stats = renderer.draw(**options.view_of(args, scene) | {"style": UNLIT, "method": args.method or "sat"})
    return renderer.triangles(), renderer.inspector.drawn_heights(), stats


def _of_map(renderer: Renderer, args: argparse.Namespace) -> tuple[np.ndarray, np.ndarray, dict[str, Any]]:
    low, high = renderer.heightmap.range_m
    max_error_m = args.max_error_m or max(RELIEF_SHARE * (high - low), 1e-6)
    max_error_m /= 1 if args.base_m is None else 2  # see `with_whole_rim`
    triangles, stats = renderer.inspector.triangulate(max_error_m)
    return triangles, renderer.terrain.filled, stats


def _texture(renderer: Renderer, args: argparse.Namespace, scene: options.CommandScene, is_page: bool) -> bytes:
    own = ("camera", "method", "max_error_px", "triangles", "parameters", "metric", "cull", "near_m")
    look = {key: value for key, value in options.view_of(args, scene).items() if key not in own}
    return file_bytes(plan(renderer, args.texture, **look), ".jpg" if is_page else ".png")
