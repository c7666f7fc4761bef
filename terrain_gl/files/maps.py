"""Maps by name: the bundled heightmaps, each with its scales and its first view; files; and samples of large files."""

import filecmp
import json
import math
import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

from ..basics.exceptions import TerrainError, UsageError
from ..basics.limits import is_too_large, store_command
from ..basics.resources import folder
from ..camera import Camera, Vector
from ..heightmap import Heightmap
from ..readers import Raster, Reading, files_of, open_raster
from ..readers.raster import Spacing, both
from ..readers.windows import RasterFile

LONGEST = 1025  # posts along the longer side of a sample
SCALES = ("spacing_m", "z_scale", "z_offset_m")


@dataclass(frozen=True)
class BundledMap:
    """A map that comes with the program: its scales, its first view with the sun, and the look of its land."""

    name: str
    path: str
    spacing_m: float
    z_scale: float
    z_offset_m: float
    eye: Vector
    target: Vector
    fov_deg: float
    sun: tuple[float, float]  # azimuth and elevation, degrees
    look: str

    def read_as(self, reading: Reading) -> Reading:
        """The reading, with this map's scales where none is given."""
        z_scale = self.z_scale if reading.z_scale is None else reading.z_scale
        z_offset_m = self.z_offset_m if reading.z_offset_m is None else reading.z_offset_m
        return replace(reading, z_scale=z_scale, z_offset_m=z_offset_m)

    @property
    def camera(self) -> Camera:
        """The map's first view."""
        return Camera(self.eye, self.target, self.fov_deg)


@cache
def bundled() -> dict[str, BundledMap]:
    """All bundled maps by name."""
    maps = folder("heightmaps")
    found = {}
    for name, entry in json.loads((maps / "maps.json").read_text("utf-8")).items():
        view = entry["view"]
        scales = entry["spacing_m"], entry["z_scale"], entry["z_offset_m"]
        eye, target, sun = (tuple(view[key]) for key in ("eye", "target", "sun"))
        found[name] = BundledMap(name, str(maps / entry["file"]), *scales, eye, target, view["fov"], sun, entry["look"])
    return found


def find_bundled(name_or_path: str) -> BundledMap | None:
    """The bundled map with a name, or the bundled map of which a file is a copy; None for any other file.

    If there is a file with the name of a bundled map, the file counts.
    """
    maps = bundled()
    if os.path.exists(name_or_path):
        return next((known for known in maps.values() if _same_file(known.path, name_or_path)), None)
    if name_or_path not in maps:
        raise TerrainError(f"{name_or_path}: neither a file nor a bundled map ({', '.join(maps)})")
    return maps[name_or_path]


def bundled_map(name: str = "alpine") -> Heightmap:
    """A map that comes with the program.

    Parameters
    ----------
    name
        "alpine", "canyon", or the same with fewer posts: "alpine-30m", "canyon-15m".

    Raises
    ------
    UsageError
        Another name.
    """
    if name not in bundled():
        raise UsageError(f"{name}: is no bundled map, only {', '.join(bundled())}; Heightmap.open reads files")
    return open_map(bundled()[name].path)[0]


def files_read(name_or_path: str) -> list[str]:
    """The real paths of the files that are read when a map is opened: a bundled map, a file, or a mosaic's sources."""
    known = None if os.path.exists(name_or_path) else bundled().get(name_or_path)
    return files_of(known.path if known else name_or_path)


def open_map(
    name_or_path: str,
    reading: Reading | None = None,
    spacing_m: float | Spacing | None = None,
    progress: Callable[[float], None] | None = None,
    raster: Raster | None = None,
) -> tuple[Heightmap, BundledMap | None]:
    """Open a bundled map or a file. The second result is the bundled map; None for a file, or if options set scales.

    Parameters
    ----------
    reading, spacing_m, progress
        As for `Heightmap.open`. A bundled map has its own scales, unless they are given.
    raster
        The file, if it is open already.
    """
    known = find_bundled(name_or_path)
    reading = reading or Reading()
    is_told = reading.is_told or spacing_m is not None
    if known:
        reading, spacing_m = known.read_as(reading), known.spacing_m if spacing_m is None else spacing_m
    path = known.path if known else name_or_path
    heightmap = Heightmap.of_raster(raster or open_raster(path, reading), reading, spacing_m, progress, path)
    if known:
        heightmap.name = known.name
        heightmap.look = known.look
    return heightmap, None if is_told else known


def _same_file(known: str, path: str) -> bool:
    try:
        return os.path.isfile(path) and filecmp.cmp(known, path, shallow=False)
    except OSError:  # unreadable: the reader reports it
        return False


# --- Large files ------------------------------------------------------------------------------------------------------


def is_huge(path: str | os.PathLike[str], reading: Reading) -> bool:
    """Whether a file has more posts than a map in memory may have; False if the path is not a file."""
    return os.path.isfile(path) and is_too_large(*posts_of(path, reading))


def posts_of(path: str | os.PathLike[str], reading: Reading) -> tuple[int, int]:
    """Rows and columns of a file."""
    raster = open_raster(path, reading)
    raster.blocks.close()
    return raster.shape[:2]


def sample(
    path: str | os.PathLike[str], reading: Reading, spacing_m: float | Spacing | None = None
) -> tuple[Heightmap, str]:
    """A coarse sample of a large raster, and one line that offers a store.

    `spacing_m` replaces the spacing in the file. `TerrainError` if GDAL, which alone can read a part of such a file,
    does not open it.
    """
    file = RasterFile(os.fspath(path), reading)
    file.voids_m = file.find_voids()
    rows, cols = file.shape
    if is_too_large(rows, cols):
        file.compare_with_the_earth(reading)
    else:
        file.guess(spacing_m)  # this reads the whole file
    size = f"{file.name}: has {cols:,} x {rows:,} posts"
    step = math.ceil(max(rows, cols) / LONGEST)
    heights = file.sample((math.ceil(rows / step), math.ceil(cols / step)))
    if heights is None:
        raise TerrainError(f"{size}, too many to be held in memory: make a store of it with {store_command(file.name)}")
    east, north = both(spacing_m or file.spacing_m or 1.0)
    few_rows, few_cols = heights.shape  # the sample reaches as far as the raster
    few = Heightmap(heights, (east * (cols - 1) / (few_cols - 1), north * (rows - 1) / (few_rows - 1)), file.name)
    few.georeference = file.georeference and file.georeference.resampled(few.cols, few.rows)
    few.notes = file.reading.unanswered(file.notes, spacing_m)
    few.values = file.values
    return few, f"{size}; this is a coarse sample, without a certified bound. For all posts: {store_command(file.name)}"
