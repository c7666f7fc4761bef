"""`terrain-gl check`: the exact error of a mesh of any program against a heightmap."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..basics.boxes import over_blocks
from ..basics.exceptions import TerrainError, UsageError
from ..files.checking import Checked, check
from ..files.maps import files_read
from ..files.mesh_readers import READERS
from ..files.tilesets import check_tiles, is_tileset
from ..files.views import standard_view
from ..heightmap import Heightmap
from ..image import write_image
from . import options, report, stores, values
from .records import CameraOptions, MapOptions
from .scene import camera_of

_LONGEST_PX = 2048  # of the picture of errors
_RATIOS = 0.0, 0.1, 0.5, 1.0, 1.05, 1.5, 3.0, 10.0, np.inf


@dataclass(frozen=True)
class CheckOptions:
    """What `check` was told."""

    map: MapOptions
    camera: CameraOptions
    mesh: str
    unit: float
    origin: tuple[float, ...] = (0.0, 0.0, 0.0)
    crs: str | None = None
    fail_above: float | None = None
    path: str | None = None
    json: str | None = None


def add(commands: options.Commands) -> None:
    """Add the command."""
    command = options.add_command(
        commands,
        "check",
        CheckOptions,
        run,
        help="the exact error of a mesh of any program",
        description="Compare a mesh with the map: its exact largest and root mean square error in metres, at posts\n"
        "and over the bilinear surface between them; gaps, overhangs, T-junctions. With a camera\n"
        "also in pixels. Vertices are metres east, north, up of the south-western post.",
        example="check mesh.glb --map dem.tif --fail-above 5 -o error.png",
    )
    command.add_argument(
        "mesh", metavar="MESH", help=f"{', '.join(READERS)}, or a folder of 3D Tiles or quantized-mesh"
    )
    command.add_argument("--map", metavar="DEM", dest="name", required=True, help="the heightmap, a file or a store")
    what = "metres of the mesh's zero: east, north, up"
    command.add_argument("--origin", type=values.point, metavar="X,Y,Z", default=(0.0, 0.0, 0.0), help=what)
    what = "metres of the mesh's unit (default: 1)"
    command.add_argument("--unit", type=values.positive, metavar="M", default=1.0, help=what)
    what = "the coordinate system of these numbers, or of tiles, such as EPSG:32632; extra [geo]"
    command.add_argument("--crs", metavar="CRS", help=what)
    what = "exit with 1 if the error at posts is larger"
    command.add_argument("--fail-above", type=values.positive, metavar="M", help=what)
    what = "picture of the errors at posts, black 0 to white the largest"
    command.add_argument("-o", "--output", metavar="OUT", dest="path", help=what)
    options.add_map_options(command)
    options.add_camera(command)
    options.add_json(command)


def run(asked: CheckOptions) -> int:
    """Run the command."""
    report.check_outputs((asked.path, asked.json), [asked.mesh, *files_read(asked.map.name)])
    heightmap = stores.open_posts(asked.map)
    if is_tileset(asked.mesh):
        return _check_tiles(asked, heightmap)
    camera = None
    if asked.camera.is_placed:
        seen = heightmap.coarse()
        camera = camera_of(asked.camera, heightmap, standard_view(seen, asked.camera.view or "default"))
    found = check(asked.mesh, heightmap, camera, asked.camera.size, asked.origin, asked.unit, asked.crs)
    if asked.path:
        write_image(asked.path, picture(found.error.of_posts))
    about = {"mesh": asked.mesh, "map": heightmap.name} | found.record(heightmap)
    report.write_json(asked.json, about)
    report.say(asked.json, text(found, heightmap))
    if asked.fail_above is not None and found.error.posts > asked.fail_above:
        raise TerrainError(
            f"{report.shown(asked.mesh)}: the error at posts is {found.error.posts:.4g} m, more than"
            f" --fail-above {asked.fail_above:g}"
        )
    return 0


def _check_tiles(asked: CheckOptions, heightmap: Heightmap) -> int:
    """Compare the declared errors of a tile set with the measured ones; exit status 1 if a tile declares too little."""
    if asked.path or asked.fail_above or asked.camera.is_placed or any(asked.origin) or asked.unit != 1:
        names = "--output, --fail-above, --origin, --unit and the camera"
        raise UsageError(f"{names} are for a mesh, not for a tile set: leave them out")
    tiles = [tile for tile in check_tiles(asked.mesh, heightmap, asked.crs) if tile.posts]
    if not tiles:
        raise TerrainError(f"{report.shown(asked.mesh)}: no tile lies on {report.shown(heightmap.name)}")
    lying = [tile for tile in tiles if tile.lies]
    listed = [tile._asdict() | {"lies": tile.lies} for tile in tiles]
    report.write_json(asked.json, {"tiles": listed, "map": heightmap.name, "lying": len(lying)})
    ratios = np.array([tile.declared_m / max(tile.posts_m, 1e-12) for tile in tiles])
    counts = [int(((ratios >= low) & (ratios < high)).sum()) for low, high in pairwise(_RATIOS)]
    rows = [["declared / measured", "tiles"]]
    rows += [[f"{low:g} to {high:g}", f"{n:,}"] for (low, high), n in zip(pairwise(_RATIOS), counts, strict=True)]
    report.say(asked.json, report.table(rows))
    if lying:
        worst = max(lying, key=lambda tile: tile.posts_m / max(tile.declared_m, 1e-12))
        raise TerrainError(
            f"{report.shown(asked.mesh)}: {len(lying):,} of {len(tiles):,} tiles declare less than their error; "
            f"{report.shown(worst.name)} declares {worst.declared_m:.4g} m and is off by {worst.posts_m:.4g} m"
        )
    return 0


def picture(of_posts: np.ndarray) -> np.ndarray:
    """The largest errors as grey, (rows, cols, 3) uint8; blue where the mesh or the map has nothing."""
    side = -(-max(of_posts.shape) // _LONGEST_PX)
    largest = over_blocks(np.fmax, of_posts, side)
    grey = np.nan_to_num(largest) / max(float(np.nanmax(of_posts, initial=0.0)), 1e-30)
    pixels = np.repeat(np.rint(255 * grey).astype("u1")[..., None], 3, -1)
    pixels[np.isnan(largest)] = 40, 60, 160
    return pixels


def text(found: Checked, heightmap: Heightmap) -> str:
    """What was found, as text."""
    error, seams = found.error, found.seams
    about = found.record(heightmap)
    east, north = about["place_m"]
    lines = {
        "at posts": f"max {error.posts:.4g} m, rms {error.posts_rms:.4g} m",
        "surface": f"max {error.surface:.4g} m, rms {error.surface_rms:.4g} m; largest at {east:g},{north:g} m",
        "mesh": f"{found.triangles:,} triangles, {found.flipped:,} flipped, {found.vertical:,} vertical",
        "covered": f"{100 * error.covered:.6g} % of the map; {round(100 * error.overlap, 9):.3g} % more than once",
        "gaps": f"{seams.gaps:.4g} cells of open edges, {seams.t_junctions:,} T-junctions,"
        f" cracks up to {seams.largest_crack_m:.3g} m",
    }
    if found.error_px:
        lines["picture"] = (
            f"max {found.error_px.posts:.3g} px at posts, {found.error_px.surface:.3g} px over the surface"
        )
    return report.facts(lines)
