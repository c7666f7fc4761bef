"""Places that the user types: coordinates, the highest point, or the name of a point of an overlay."""

import re
from collections.abc import Iterator
from contextlib import suppress

import numpy as np

from ..basics.exceptions import TerrainError, UsageError
from ..heightmap import Heightmap
from ..readers.place import Point
from ..renderer import Renderer
from ..renderer.lines import on_land, posts_on_land

HIGHEST = "highest"
LARGEST = "largest error"
_PAIR = re.compile(r"\s*([-−+]?\d*\.?\d+)\s*°?\s*([NSEWnsew]?)\s*[,; ]\s*([-−+]?\d*\.?\d+)\s*°?\s*([NSEWnsew]?)\s*")


def place_of(renderer: Renderer, typed: str) -> np.ndarray:
    """The place on the land that a text names, (3,) in world metres.

    Coordinates are those that the window shows: of the map's file, or degrees. Two numbers without letters that are not
    on the map are latitude and longitude. On a map without a place, they are metres from the south-west corner.

    Raises
    ------
    UsageError
        The text names no place, or a place without land.
    """
    heightmap = renderer.heightmap
    if typed.strip().lower() == HIGHEST:
        return _highest(heightmap)
    if pair := _PAIR.fullmatch(typed):
        found = (on_land(heightmap, np.array([at]))[0] for at in _positions(heightmap, *pair.groups()))
        place = next((place for place in found if np.isfinite(place).all()), None)
    else:
        place = _named(renderer, typed.strip().lower())
    if place is None:
        what = "is not on the land of this map" if pair else "is no point of an overlay"
        raise UsageError(f"{typed.strip()!r} {what}: type two coordinates, {HIGHEST}, or a name")
    return place


def _positions(heightmap: Heightmap, first: str, its: str, second: str, other: str) -> Iterator[Point]:
    """World metres that two numbers can mean."""
    x, y = (float(number.replace("−", "-")) for number in (first, second))
    letters = (its + other).upper()
    x, y = x * (-1 if its in "SWsw" and its else 1), y * (-1 if other in "SWsw" and other else 1)
    if re.fullmatch("[NS][EW]", letters):
        x, y = y, x
    place = heightmap.place
    if place is None:
        if not letters:
            yield x, y
        return
    with suppress(TerrainError):
        yield place.from_map(x, y)
    with suppress(TerrainError):  # without a coordinate system, or without pyproj
        yield place.from_lonlat(x, y) if letters else place.from_lonlat(y, x)


def _named(renderer: Renderer, typed: str) -> np.ndarray | None:
    """The first point whose name is the text, or begins with it."""
    named = [pair for each in renderer.overlays for pair in zip(each.names, each.points, strict=False) if pair[0]]
    for matches in (str.__eq__, str.startswith):
        for name, post in named:
            if typed and matches(name.lower(), typed):
                return posts_on_land(renderer.heightmap, np.array([post]))[0]
    return None


def _highest(heightmap: Heightmap) -> np.ndarray:
    heightmap = heightmap.coarse()
    row, col = np.unravel_index(np.nanargmax(heightmap.heights), heightmap.heights.shape)
    return posts_on_land(heightmap, np.array([[col, row]], float))[0]
