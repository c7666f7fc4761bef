"""`terrain-gl mesh`: a file of the whole map as triangles, or of exactly the triangles that the GPU draws."""

import argparse
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..basics.exceptions import TerrainError, UsageError
from ..files.export import FORMATS, files_beside, land_mesh, mesh_format, with_whole_rim, write_mesh
from ..files.maps import is_huge
from ..files.mesh_formats import PRINT_MM, Mesh
from ..files.whole import whole_mesh
from ..heightmap import Heightmap
from ..image import file_bytes
from ..renderer import Renderer
from ..renderer.options import RenderOptions
from ..renderer.plan import LONGEST_PX, plan
from ..shade.picture import UNLIT
from . import options, report, stores, values
from .records import DrawOptions
from .scene import CommandScene, make_renderer, open_scene

RELIEF_SHARE = 5e-3  # default error of a mesh, as a part of the map's relief
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
    between: bool = False
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
        return is_asked and not self.max_error_m and not self.between

    def tolerance_m(self, heightmap: Heightmap) -> float:
        """The error of a whole map."""
        low, high = heightmap.range_m
        return self.max_error_m or max(RELIEF_SHARE * (high - low), 1e-6)


def add(commands: options.Commands) -> None:
    """Add the command."""
    command = options.add_command(
        commands,
        "mesh",
        MeshOptions,
        run,
        help="the map as triangles: a .ply, .glb, .obj or .stl file, or an .html page",
        description="Triangles in metres: of the whole map, or of a view. .stl is a solid.",
        example="mesh dem.tif -o dem.glb --max-error-m 5 --texture",
    )
    options.add_map(command)
    options.add_output(command, f"mesh, {', '.join(FORMATS)}")
    what = f"largest error at posts (default: {100 * RELIEF_SHARE:g} %% of the relief)"
    command.add_argument("--max-error-m", type=values.positive, metavar="M", help=what)
    what = "certify it between posts, too, by more triangles"
    command.add_argument("--between", action="store_true", help=what)
    add_texture(command)
    what = "share vertices (default), or three for each triangle"
    command.add_argument("--weld", action=argparse.BooleanOptionalAction, default=True, help=what)
    what = f".stl: longer side in millimetres (default: {PRINT_MM:g})"
    command.add_argument("--print-mm", type=values.positive, metavar="MM", default=PRINT_MM, help=what)
    what = ".stl: height of the base; tiles of one base meet"
    command.add_argument("--base-m", type=values.number, metavar="M", help=what)
    command.add_argument("--cull", action="store_true", help="of a view: leave out patches outside the picture")
    stores.add_options(command)
    options.add_rendering(command)
    command.set_defaults(method=None)
    options.describe(command, max_error_px="screen error: the mesh of a view")


def add_texture(command: options.Options) -> None:
    """Add the option for a picture of the map on the triangles."""
    what = f"the look from above, N pixels long (default: {LONGEST_PX})"
    command.add_argument("--texture", type=values.count, metavar="N", nargs="?", const=LONGEST_PX, help=what)


def run(asked: MeshOptions) -> int:
    """Run the command."""
    path, told = asked.output.path, asked.output.json
    mesh_format(path)
    if (asked.max_error_m or asked.between) and asked.given.keys() & {"triangles", "max_error_px", "method"}:
        names = "--triangles, --max-error and --method"
        raise UsageError(f"--max-error-m and --between are for the whole map, not for a view: leave out {names}")
    if asked.base_m is not None and (Path(path).suffix.lower() != ".stl" or asked.has_view):
        raise UsageError("--base-m is for the solid of a whole map, an .stl without a camera")
    if asked.texture_px:
        report.check_writable(*map(str, files_beside(path)))
    mesh, stats = _captured(asked) if asked.has_view or asked.between else _of_posts(asked)
    about = stats | {"vertices": len(mesh.posts)}
    with report.json_output(told, about), report.progress_bar("writing") as progress:
        write_mesh(path, replace(mesh, print_mm=asked.print_mm), progress)
    counts = f"{len(mesh.faces):,} triangles, {len(mesh.posts):,} vertices"
    report.say(told, f"{report.shown(path)}: {counts}{_bound(stats)}")
    return stores.status_of(about)


def _bound(stats: dict[str, Any]) -> str:
    """The error of the whole map's mesh as text; "" for the mesh of a view."""
    if "max_error_posts_m" in stats:
        every_post = f"every post as a vertex: {stats['every_post_max_error_surface_m']:.3g} m"
        between = f"{stats['max_error_surface_m']:.3g} m between them ({every_post})"
        return f", within {stats['max_error_posts_m']:.3g} m at posts, {between}"
    within_m = stats.get("certified_max_error_m")
    return "" if within_m is None else f", within {within_m:.3g} m at posts and between them"


def _of_posts(asked: MeshOptions) -> tuple[Mesh, dict[str, Any]]:
    """The mesh of the whole map whose error is checked, and its numbers. The GPU draws only its texture."""
    if is_huge(asked.map.name, asked.map.reading):
        raise UsageError(f"{report.shown(asked.map.name)}: has too many posts for memory: give --between")
    scene = open_scene(_in_memory(asked))
    _tell_water(scene)
    land = _with_sea(scene).heightmap
    tolerance_m = asked.tolerance_m(land)
    whole = whole_mesh(land, tolerance_m if asked.base_m is None else tolerance_m / 2)  # see `with_whole_rim`
    mesh = land_mesh(land, whole.triangles, _exaggerated(scene, whole.filled), scene.frame.voids, asked.weld)
    if asked.base_m is not None:
        mesh = _on_base(asked, scene, mesh)
        tops_m = mesh.tops_m(slice(None)).astype(np.float64) / scene.frame.exaggeration
        whole = whole.checked(land, mesh.posts, tops_m, mesh.faces)
    if asked.texture_px:
        with make_renderer(scene, asked) as renderer, stores.loading(renderer):
            mesh = replace(mesh, texture=_texture(renderer, asked, scene))
    mesh = replace(mesh, error_m=(whole.error.posts, whole.error.surface))
    return mesh, {"map": land.name} | whole.stats | {"requested_max_error_m": tolerance_m}


def _captured(asked: MeshOptions) -> tuple[Mesh, dict[str, Any]]:
    """Triangles that the GPU makes, and their numbers."""
    scene = open_scene(asked)
    _tell_water(scene)
    drawn = _drawn(asked, scene)
    if drawn is None:
        report.note("the mesh needs more tiles than --gpu-memory holds: the raster is held in memory instead")
        scene = open_scene(_in_memory(asked))
        drawn = _drawn(asked, scene)
    assert drawn
    mesh, stats = drawn
    if asked.base_m is not None:
        mesh = _on_base(asked, scene, mesh)
        stats["certified_max_error_m"] *= 2  # see `with_whole_rim`
    within_m = stats.get("certified_max_error_m")
    if within_m and stats.get("complete", True) and within_m > stats["requested_max_error_m"]:
        report.note(f"cells cannot be cut more finely: the error is up to {within_m:.3g} m")
    return replace(mesh, within_m=within_m), {"map": scene.heightmap.name} | stats


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
        found = _of_view(renderer, scene) if asked.has_view else _of_map(renderer, asked)
        triangles, heights, stats = found
        if not stats.get("complete", True) and stores.may_be_held(scene.heightmap):
            return None
        if not len(triangles):
            raise TerrainError(f"{scene.heightmap.name}: no triangles in this view: turn the camera or drop --cull")
        heights = _exaggerated(scene, heights)
        mesh = land_mesh(renderer.heightmap, triangles, heights, scene.frame.voids, asked.weld)
    return replace(mesh, texture=texture), stats


def _in_memory(asked: MeshOptions) -> MeshOptions:
    return replace(asked, store=replace(asked.store, no_cache=True))


def _exaggerated(scene: CommandScene, heights: np.ndarray) -> np.ndarray:
    factor = scene.frame.exaggeration
    return heights if factor == 1 else heights * np.float32(factor)


def _on_base(asked: MeshOptions, scene: CommandScene, mesh: Mesh) -> Mesh:
    """The mesh of a solid whose base has a height, and whose rim meets that of a neighbour."""
    assert asked.base_m is not None
    return replace(with_whole_rim(mesh), bottom_m=asked.base_m * scene.frame.exaggeration)


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
    return renderer.triangles(), renderer.inspector.drawn_heights(), dict(stats)


def _of_map(renderer: Renderer, asked: MeshOptions) -> tuple[np.ndarray, np.ndarray, dict[str, Any]]:
    triangles, stats = renderer.inspector.triangulate(asked.tolerance_m(renderer.heightmap))
    return triangles, renderer.terrain.filled, dict(stats)


def _texture(renderer: Renderer, asked: MeshOptions, scene: CommandScene) -> bytes:
    return file_bytes(from_above(renderer, scene, asked.texture_px or LONGEST_PX), ".jpg" if asked.is_page else ".png")


def from_above(renderer: Renderer, scene: CommandScene, longest_px: int) -> np.ndarray:
    """The look of the map from straight above."""
    own = ("camera", "method", "max_error_px", "triangles", "parameters", "metric", "cull", "near_m")
    return plan(renderer, longest_px, **{key: value for key, value in scene.view().items() if key not in own})
