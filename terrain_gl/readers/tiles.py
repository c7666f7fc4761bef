"""Web tiles: their names give their place. A tile z/x/y is column x, row y from the north, of 2^z × 2^z tiles.

Most tiles divide the square of Web Mercator (EPSG:3857); some divide longitude and latitude into 2^(z+1) × 2^z tiles.
Rows count from the south where the path, or a file beside the folders of zooms, says that the tiles are TMS.
"""

import math
import os
import re
from dataclasses import replace

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.readers.georeference import DEGREES, WGS84, Georeference, Grid, metres_per_degree
from terrain_gl.readers.raster import Raster

_NAME = re.compile(r"(?:^|[/\\_.-])(\d\d?)[/\\_-](\d+)[/\\_-](\d+)(?:@\dx)?\.\w+$")
_OF_DEGREES = re.compile(r"4326|geodetic|wgs.?84|crs.?84", re.IGNORECASE)
_TMS = re.compile(r"(?:^|[/\\_.-])tms(?:[/\\_.-]|$)", re.IGNORECASE)
_SAYS_TMS = re.compile(r"""["']scheme["']\s*:\s*["']tms""")
_LOSSY = re.compile(rb"\xff\xd8\xff|RIFF....WEBPVP8 ", re.DOTALL)  # JPEG, and WebP of that kind
_MOST_ZOOM = 24
_LEAST_ZOOM = 6  # of a tile whose pixels are plain heights: other pictures have such names, too
_SIDES = (256, 512, 1024)


def placed_by_name(raster: Raster, path: str, is_packed: bool) -> Raster:
    """The raster with the place that its name gives, if it is a web tile without a place of its own.

    Heights that are packed in colours are web tiles; if they are not, `is_packed` is false, and a note says so.
    """
    found = _NAME.search(os.path.abspath(path))
    rows, cols, _ = raster.shape
    side = next((side for side in _SIDES if cols - side in (0, 1, 2, 4)), 0)  # 257 posts share those of the edges
    if found is None or raster.georeference is not None or raster.spacing_m is not None or not side or rows != cols:
        return raster
    zoom, x, y = map(int, found.groups())
    y = 2**zoom - 1 - y if _is_tms(path) else y
    is_of_degrees = x >= 2**zoom or bool(_OF_DEGREES.search(path))
    fits = zoom <= _MOST_ZOOM and y < 2**zoom and x < 2 ** (zoom + is_of_degrees)
    if not fits or (not is_packed and zoom < _LEAST_ZOOM):
        return raster
    beyond = (cols - side) / 2  # posts beyond the tile's edge
    tile = (180.0 if is_of_degrees else 360.0) / 2**zoom
    step = tile / side
    middle = y + 0.5
    latitude = 90 - middle * tile
    if not is_of_degrees:
        latitude = math.degrees(math.atan(math.sinh(math.pi - 2 * math.pi * middle / 2**zoom)))
    east, north = metres_per_degree(latitude)
    grid = Grid(step, 0.0, -180 + x * tile - beyond * step, 0.0, -step, 90 - y * tile + beyond * step)
    spacing_m = east * step, north * step
    if not is_of_degrees:  # a step of Mercator is cos φ times as long
        unit = math.radians(1) * WGS84[0]
        grid = Grid(*(unit * value for value in grid))._replace(f=unit * (180 - y * tile + beyond * step))
        spacing_m = east * step, north * step * math.cos(math.radians(latitude))
    place = Georeference(grid, DEGREES if is_of_degrees else "EPSG:3857", (cols, rows))
    word = f"its name places it as tile {zoom}/{x}/{y}, {spacing_m[0]:.4g} m between posts (--spacing)"
    return replace(raster, georeference=place, spacing_m=spacing_m, notes=raster.notes + (() if is_packed else (word,)))


def _is_tms(path: str) -> bool:
    """Whether rows count from the south, by the path, or by the files of gdal2tiles or of MBTiles beside the zooms."""
    root = os.path.join(os.path.dirname(os.path.abspath(path)), "..", "..")
    about = os.path.join(root, "metadata.json")
    if os.path.isfile(about):
        with open(about, encoding="utf-8", errors="replace") as file:
            return bool(_SAYS_TMS.search(file.read(100_000)))
    return bool(_TMS.search(path)) or os.path.isfile(os.path.join(root, "tilemapresource.xml"))


def check_packed(name: str, head: bytes) -> None:
    """`TerrainError` if heights that are packed in colours went through a lossy compression."""
    if _LOSSY.match(head):
        raise TerrainError(f"{name}: is compressed with losses, which spoil packed heights: get the tiles as PNG")


def example_of_tiles(folder: str) -> str | None:
    """A pattern of shells for all tiles of the highest zoom in a folder z/x/y; None if there are none."""
    for zoom in sorted((each for each in os.listdir(folder) if each.isdecimal()), key=int, reverse=True):
        for column, _, files in os.walk(os.path.join(folder, zoom)):
            if files and _NAME.search(os.path.join(os.path.abspath(column), files[0])):
                return os.path.join(os.path.dirname(column), "*", "*" + os.path.splitext(files[0])[1])
    return None
