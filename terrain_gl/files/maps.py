"""The bundled heightmaps, by name. Each map has its scales and its first view."""

import filecmp
import json
import os
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from functools import cache

from ..basics.exceptions import TerrainError
from ..basics.resources import folder
from ..camera import Camera, Vector
from ..heightmap import Heightmap
from ..readers import Reading, files_of
from ..readers.raster import Spacing

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


def files_read(name_or_path: str) -> list[str]:
    """The real paths of the files that are read when a map is opened: a bundled map, a file, or a mosaic's sources."""
    known = None if os.path.exists(name_or_path) else bundled().get(name_or_path)
    return files_of(known.path if known else name_or_path)


def open_map(
    name_or_path: str,
    reading: Reading | None = None,
    spacing_m: float | Spacing | None = None,
    progress: Callable[[float], None] | None = None,
) -> tuple[Heightmap, BundledMap | None]:
    """Open a bundled map or a file. The second result is the bundled map; None for a file, or if options set scales.

    Parameters
    ----------
    reading, spacing_m, progress
        As for `Heightmap.open`. A bundled map has its own scales, unless they are given.
    """
    known = find_bundled(name_or_path)
    reading = reading or Reading()
    is_told = reading.is_told or spacing_m is not None
    if known:
        reading, spacing_m = known.read_as(reading), known.spacing_m if spacing_m is None else spacing_m
    heightmap = Heightmap.open(known.path if known else name_or_path, spacing_m, progress=progress, **asdict(reading))
    if known:
        heightmap.name = known.name
        heightmap.look = known.look
    return heightmap, None if is_told else known


def _same_file(known: str, path: str) -> bool:
    try:
        return os.path.isfile(path) and filecmp.cmp(known, path, shallow=False)
    except OSError:  # unreadable: the reader reports it
        return False
