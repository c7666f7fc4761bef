"""`terrain-gl tiles`: 3D Tiles of a map, which declare the errors that they have."""

import os
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..files.maps import files_read
from ..files.tile_server import serve
from ..files.tiling import Tiling, write_tiles
from . import options, report, stores, values
from .mesh import add_texture, from_above
from .records import DrawOptions, StoreOptions
from .scene import make_renderer, open_scene

_PORT = 8000
_DRAWN = StoreOptions(gpu_memory=512, memory=512)  # of a store, while its picture is drawn
_RELIEF_SHARE = 1e-3  # default error of the finest tiles, as a part of the map's relief


@dataclass(frozen=True)
class TilesOptions(DrawOptions):
    """What `tiles` was told."""

    texture: int | None = None
    workers: int = 1
    scheduler: str | None = None
    max_error_m: float | None = None
    local: bool = False
    serve: int | None = None


def add(commands: options.Commands) -> None:
    """Add the command."""
    command = options.add_command(
        commands,
        "tiles",
        TilesOptions,
        run,
        help="3D Tiles of a map, with their true errors",
        description="A folder of 3D Tiles 1.1: an explicit quadtree, a .glb for each tile. geometricError is the\n"
        "error of the tile against all posts of the map. The same command continues an interrupted one.\n"
        "Extras [geo] and [mesh].",
        example="tiles dem.tif -o tiles --max-error-m 2",
    )
    options.add_map(command)
    command.add_argument("-o", "--output", metavar="DIR", dest="path", required=True, help="the folder to write")
    what = f"largest error of the finest tiles, at posts (default: {100 * _RELIEF_SHARE:g} %% of the relief)"
    command.add_argument("--max-error-m", type=values.positive, metavar="M", help=what)
    what = "metres east, north, up of the south-western post, not a place on the Earth"
    command.add_argument("--local", action="store_true", help=what)
    what = f"then show them in a browser, at a port of this machine (default: {_PORT}); a finished folder at once"
    command.add_argument("--serve", type=values.count, metavar="PORT", nargs="?", const=_PORT, help=what)
    options.add_workers(command)
    add_texture(command)
    options.add_look(command)
    options.add_backend(command)
    options.add_json(command)


def run(asked: TilesOptions) -> int:
    """Run the command."""
    folder = Path(asked.output.path)
    if asked.serve is None or not (folder / "tileset.json").is_file():
        _write(asked)
    if asked.serve is not None:
        serve(folder, asked.serve, lambda address: report.note(f"{address} shows the tiles; Ctrl-C ends"))
    return 0


def _write(asked: TilesOptions) -> None:
    """Make the tiles."""
    path, told = asked.output.path, asked.output.json
    report.check_writable(told)
    report.refuse_inputs((path, told), [*files_read(asked.map.name), *asked.files])
    heightmap = stores.open_posts(asked.map)
    place = heightmap.place
    is_local = asked.local or place is None or place.crs is None
    if is_local and not asked.local:
        report.note(
            f"{report.shown(heightmap.name)}: does not say where it lies: tiles are in metres east, north, up of its "
            "south-western post (--local); gdal_translate -a_srs -a_ullr gives it a place"
        )
    low_m, high_m = heightmap.range_m
    name, reading, spacing_m = asked.map.source
    source = os.path.abspath(name) if os.path.exists(name) else name, reading, spacing_m
    tiling = Tiling(heightmap, asked.max_error_m or max(_RELIEF_SHARE * (high_m - low_m), 1e-6), is_local, source)
    picture = _picture(asked, asked.texture) if asked.texture else None
    with report.progress_bar("tiling") as progress:
        about = write_tiles(tiling, path, progress, picture, asked.workers, asked.scheduler)
    report.write_json(told, about)
    errors = about["max_error_m"]
    text = f"{about['tiles']:,} tiles on {about['levels']} levels, {about['triangles']:,} triangles"
    text += f", within {errors['finest']:.3g} m (finest) to {errors['coarsest']:.3g} m (coarsest)"
    report.say(told, f"{report.shown(path)}: {text}")


def _picture(asked: TilesOptions, longest_px: int) -> np.ndarray:
    """The map from above, as `mesh --texture` shows it."""
    scene = open_scene(replace(asked, output=replace(asked.output, path="", json=None), store=_DRAWN))
    with make_renderer(scene, asked, lit=True) as renderer, stores.loading(renderer):
        return from_above(renderer, scene, longest_px)
