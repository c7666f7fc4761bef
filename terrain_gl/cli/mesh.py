"""`terrain-gl mesh`: a file with exactly the triangles that the GPU draws."""

import argparse
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..basics.exceptions import TerrainError, UsageError
from ..files.export import FORMATS, files_beside, land_mesh, mesh_format, with_whole_rim, write_mesh
from ..files.mesh_formats import PRINT_MM, Mesh
from ..image import file_bytes
from ..renderer import Renderer
from ..renderer.options import RenderOptions
from ..renderer.plan import LONGEST_PX, plan
from ..shade.picture import UNLIT
from . import options, report, stores, values
from .outputs import check_writable
from .records import DrawOptions
from .scene import CommandScene, make_renderer, open_scene

RELIEF_SHARE = 5e-3  # default error of a mesh, as a part of the map's relief
_PAYS_TIMES = 4  # a raster of fewer posts than 4 · `cache.PAYS_POSTS` is held in memory: no store is built for it
_VIEW_OPTIONS = ("method", "max_error_px", "triangles", "parameters")  # they ask for the mesh of a view


@dataclass(frozen=True)
class MeshOptions(DrawOptions):
    """What `mesh` was told."""

    given: RenderOptions
    weld: bool
    cull: bool
    print_mm: float
    texture: int | None = None
    max_error_m: float | None = None
    base_m: float | None = None

    @property
    def is_page(self) -> bool:
        """Whether the file is a page for a browser, which always has a texture."""
        return Path(self.output.path).suffix.lower() == ".html"

    @property
    def texture_px(self) -> int | None:
        """Length of the texture in pixels; None without one."""
        return self.texture or (LONGEST_PX if self.is_page else None)

    @property
    def has_view(self) -> bool:
        """Whether the options request the mesh of a view."""
        is_asked = any(name in self.given for name in _VIEW_OPTIONS) or self.cull or self.camera.is_placed
        return is_asked and not self.max_error_m


def add(commands: Any) -> None:
    """Add the command."""
    command = options.add_command(
        commands,
        "mesh",
        MeshOptions,
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


def run(asked: MeshOptions) -> int:
    """Run the command."""
    path, told = asked.output.path, asked.output.json
    mesh_format(path)
    if asked.max_error_m and asked.given.keys() & {"triangles", "max_error_px", "method"}:
        names = "--triangles, --max-error and --method"
        raise UsageError(f"--max-error-m is for the whole map, not for a view: leave out {names}")
    if asked.base_m is not None and (Path(path).suffix.lower() != ".stl" or asked.has_view):
        raise UsageError("--base-m is for the solid of a whole map, an .stl without a camera")
    if asked.texture_px:
        check_writable(*map(str, files_beside(path)))
    scene = open_scene(asked)
    _tell_water(scene)
    drawn = _drawn(asked, scene)
    if drawn is None:
        report.note("the mesh needs more tiles than --gpu-memory holds: the raster is held in memory instead")
        scene = open_scene(replace(asked, store=replace(asked.store, no_cache=True)))
        drawn = _drawn(asked, scene)
    assert drawn
    mesh, stats = drawn
    if asked.base_m is not None:
        mesh = replace(with_whole_rim(mesh), bottom_m=asked.base_m * scene.frame.exaggeration)
        stats["certified_max_error_m"] *= 2  # see `with_whole_rim`
    within_m = stats.get("certified_max_error_m")
    mesh = replace(mesh, within_m=within_m, print_mm=asked.print_mm)
    about = {"map": scene.heightmap.name} | stats | {"vertices": len(mesh.posts)}
    with report.json_output(told, about), report.progress_bar("writing") as progress:
        write_mesh(path, mesh, progress)
    within = "" if within_m is None else f", within {within_m:.3g} m"
    counts = f"{len(mesh.faces):,} triangles, {len(mesh.posts):,} vertices"
    report.say(told, f"{report.shown(path)}: {counts}{within}")
    return stores.status_of(about)


def _drawn(asked: MeshOptions, scene: CommandScene) -> tuple[Mesh, dict[str, Any]] | None:
    """The mesh and its numbers; None if a raster's store lacks room for its tiles, and the raster fits into memory."""
    sea = _with_sea(scene)
    texture = None
    if asked.texture_px and sea is not scene:  # water is drawn over its bed
        with make_renderer(scene, asked) as renderer:
            texture = _texture(renderer, asked, scene)
    with make_renderer(sea, asked) as renderer, stores.loading(renderer):
        if method := asked.given.get("method"):
            renderer.check_method(method)
        if asked.texture_px and texture is None:
            texture = _texture(renderer, asked, scene)
        found = _of_view(renderer, scene) if asked.has_view else _of_map(renderer, asked.max_error_m)
        triangles, heights, stats = found
        if not stats.get("complete", True) and stores.may_be_held(scene.heightmap):
            return None
        if not len(triangles):
            raise TerrainError(f"{scene.heightmap.name}: no triangles in this view: turn the camera or drop --cull")
        frame = scene.frame
        heights = heights if frame.exaggeration == 1 else heights * np.float32(frame.exaggeration)
        mesh = land_mesh(renderer.heightmap, triangles, heights, frame.voids, asked.weld)
    return replace(mesh, texture=texture), stats


def _with_sea(scene: CommandScene) -> CommandScene:
    """The scene whose land below --water is the level sea."""
    water_m = scene.frame.water_m
    if water_m is None:
        return scene
    if scene.heightmap.is_store:
        raise UsageError(
            "--water: a mesh of a store cannot have a sea: give the raster with --no-cache, or drop --water"
        )
    return replace(scene, heightmap=scene.heightmap.copy(np.maximum(scene.heightmap.heights, np.float32(water_m))))


def _tell_water(scene: CommandScene) -> None:
    low_m, water_m = scene.heightmap.range_m[0], scene.frame.water_m
    if water_m is not None and water_m <= low_m:
        report.note(f"--water {water_m:g}: without effect, because the lowest height is {low_m:g} m")


def _of_view(renderer: Renderer, scene: CommandScene) -> tuple[np.ndarray, np.ndarray, dict[str, Any]]:
    stats = renderer.draw(**scene.view(style=UNLIT))
    return renderer.triangles(), renderer.inspector.drawn_heights(), stats


def _of_map(renderer: Renderer, max_error_m: float | None) -> tuple[np.ndarray, np.ndarray, dict[str, Any]]:
    low, high = renderer.heightmap.range_m
    triangles, stats = renderer.inspector.triangulate(max_error_m or max(RELIEF_SHARE * (high - low), 1e-6))
    return triangles, renderer.terrain.filled, stats


def _texture(renderer: Renderer, asked: MeshOptions, scene: CommandScene) -> bytes:
    own = ("camera", "method", "max_error_px", "triangles", "parameters", "metric", "cull", "near_m")
    look = {key: value for key, value in scene.view().items() if key not in own}
    return file_bytes(plan(renderer, asked.texture_px or LONGEST_PX, **look), ".jpg" if asked.is_page else ".png")
